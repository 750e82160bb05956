/* A finger is pressed 1 mm onto a plane that then slides; prints when the contact begins to slip and when all of it does.
 * The model lies in the program, as it would in the flash of a microcontroller. */
#include <fingerpad.h>
#include <fingertip_fpm.h>
#include <stdio.h>

int main(void)
{
    fingerpad_model model;
    fingerpad_state finger;
    fingerpad_watch watch;
    fingerpad_watch_settings settings;
    int32_t code = fingerpad_model_load(&model, (const uint8_t *)fingertip_fpm, FINGERTIP_FPM_BYTES);
    if (code != FINGERPAD_OK) {
        printf("model: %s\n", fingerpad_error_text(code));
        return 1;
    }
    (void)fingerpad_state_init(&finger);
    (void)fingerpad_watch_settings_default(&settings);
    (void)fingerpad_watch_init(&watch, 0, settings);

    for (int i = 0; i < 1000; i++) {
        /* 10 kHz: 0.1 s of pressing, then 2 mm of slide along the finger. */
        fingerpad_motion motion = {0};
        fingerpad_response response;
        fingerpad_event events[FINGERPAD_EVENTS_A_LOOK];
        uint32_t count = 0;
        motion.depth_mm = i < 100 ? 0.01f * (float)(i + 1) : 1.0f;
        motion.slide_x_mm = i < 100 ? 0.0f : 2.0f / 900.0f;
        motion.dt_s = 1e-4f;
        code = fingerpad_step(&model, &finger, motion, &response);
        if (code == FINGERPAD_OK) {
            code = fingerpad_watch_look(&watch, &response, events, &count);
        }
        if (code != FINGERPAD_OK) {
            printf("step %d: %s\n", i, fingerpad_error_text(code));
            return 1;
        }
        for (uint32_t k = 0; k < count; k++) {
            const char *const words[] = {"touch", "first slip", "full slip", "restick", "lift-off"};
            printf("%s at step %d: normal force %.3f N, friction %.3f N, slip margin %.2f\n", words[events[k].change], i,
                   (double)response.normal_force_n, (double)response.friction_x_n, (double)response.slip_margin);
        }
    }
    return 0;
}
