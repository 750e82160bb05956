/* A finger is pressed 1 mm onto a ball of 20 mm radius, then rolls sideways on it: roll_on_ball FINGERTIP-PAD.fpm
 * Prints how the contact wanders along the skin, and the load of the middle of the skin. */
#include "common.h"

int main(int argc, char **argv)
{
    static model_file file;
    static fingerpad_pad pad;
    static fingerpad_pad_state finger;
    static fingerpad_patch patches[FINGERPAD_PATCHES_MAX];
    const fingerpad_body ball = {FINGERPAD_BODY_SPHERE, 20.0f, 0.0f, 0.0f};
    fingerpad_pad_motion motion = {0.0f, 0.0f, 0.0f, 0.0f, 30.0f, 0.0f, 1e-3f};
    fingerpad_pad_info info;
    fingerpad_response r;
    uint32_t i, k;
    if (argc != 2) {
        return 2;
    }
    read_file(&file, argv[1]);
    must(fingerpad_pad_load(&pad, bytes_of(&file), file.length), argv[1]);
    must(fingerpad_pad_describe(&pad, &info), "info");
    must(fingerpad_pad_state_init_over(&pad, &finger, motion.pitch_deg, motion.roll_deg), "state");
    for (i = 1; i <= 300; i++) {
        uint32_t touching = 0;
        motion.depth_mm = i < 100 ? 0.01f * (float)i : 1.0f;
        motion.roll_deg = i < 100 ? 0.0f : 0.1f * (float)(i - 100);
        must(fingerpad_pad_step(&pad, &finger, ball, motion, &r), "step");
        must(fingerpad_pad_patches(&pad, &finger, ball, patches, FINGERPAD_PATCHES_MAX), "patches");
        for (k = 0; k < info.patches; k++) {
            touching += patches[k].contact_area_mm2 > 0.0f;
        }
        if (i % 50 == 0) {
            (void)printf("roll %4.1f degrees: normal force %.3f N, friction across %+.3f N, %2d patches touch, centre at %+.2f mm\n",
                         (double)motion.roll_deg, (double)r.normal_force_n, (double)r.friction_y_n, (int)touching,
                         (double)r.pressure_centre_y_mm);
        }
    }
    return r.status != 0;
}
