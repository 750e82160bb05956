// A press and a slide at 1 kHz, as a controller's callback would step them.
#include <fingerpad.h>
#include <fingertip_fpm.h>

#include <cstdio>
#include <stdexcept>

namespace
{
// A finger of one model: an error of the C library becomes an exception where it is set up, and nowhere else.
class Finger
{
public:
    Finger()
    {
        check(fingerpad_model_load(&model_, reinterpret_cast<const uint8_t *>(fingertip_fpm), FINGERTIP_FPM_BYTES));
        check(fingerpad_state_init(&state_));
    }

    fingerpad_response step(float depth_mm, float slide_x_mm) noexcept
    {
        fingerpad_response response{};
        (void)fingerpad_step(&model_, &state_, {depth_mm, slide_x_mm, 0.0F, 0.0F, 1e-3F}, &response);
        return response;
    }

private:
    static void check(int32_t code)
    {
        if (code != FINGERPAD_OK) {
            throw std::runtime_error(fingerpad_error_text(code));
        }
    }

    fingerpad_model model_;
    fingerpad_state state_;
};
}  // namespace

int main()
{
    Finger finger;
    for (int i = 0; i <= 100; ++i) {
        (void)finger.step(0.01F * static_cast<float>(i), 0.0F);
    }
    for (int i = 0; i < 100; ++i) {
        const fingerpad_response r = finger.step(1.0F, 0.01F);
        if (i % 25 == 24) {
            std::printf("slide %.2f mm: friction %.3f N, slip margin %.2f\n", 0.01 * (i + 1),
                        static_cast<double>(r.friction_x_n), static_cast<double>(r.slip_margin));
        }
    }
    return 0;
}
