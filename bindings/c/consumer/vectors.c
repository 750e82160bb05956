/* Steps through the documented test vectors and compares the bits: vectors MODEL.fpm FPM-FORMAT.md */
#include "common.h"

/* One documented line: three numbers of the motion, nine words, regime and status. */
static int agrees(const char *line, const fingerpad_model *model, fingerpad_state *state)
{
    fingerpad_motion motion;
    fingerpad_response r;
    uint32_t want[9], regime, status, got[9];
    motion.spin_rad = 0.0f;
    motion.dt_s = 1e-3f;
    if (sscanf(line,
               "%f %f %f | %" SCNx32 " %" SCNx32 " %" SCNx32 " %" SCNx32 " %" SCNx32 " %" SCNx32 " %" SCNx32 " %" SCNx32
               " %" SCNx32 " %" SCNu32 " %" SCNu32,
               &motion.depth_mm, &motion.slide_x_mm, &motion.slide_y_mm, &want[0], &want[1], &want[2], &want[3],
               &want[4], &want[5], &want[6], &want[7], &want[8], &regime, &status) != 14) {
        return 0;
    }
    must(fingerpad_step(model, state, motion, &r), "step");
    got[0] = bits(r.normal_force_n);
    got[1] = bits(r.friction_x_n);
    got[2] = bits(r.friction_y_n);
    got[3] = bits(r.stick_ratio);
    got[4] = bits(r.friction_limit_n);
    got[5] = bits(r.slip_margin);
    got[6] = bits(r.contact_area_mm2);
    got[7] = bits(r.band_normal_n);
    got[8] = bits(r.band_friction_n);
    return memcmp(want, got, sizeof want) == 0 && regime == r.regime && status == r.status;
}

int main(int argc, char **argv)
{
    static model_file file;
    fingerpad_model model;
    fingerpad_state state;
    char line[512];
    int inside = 0, compared = 0;
    FILE *document;
    if (argc != 3) {
        return 2;
    }
    read_file(&file, argv[1]);
    must(fingerpad_model_load(&model, bytes_of(&file), file.length), argv[1]);
    must(fingerpad_state_init(&state), "state");
    document = fopen(argv[2], "r");
    if (document == NULL) {
        perror(argv[2]);
        return 2;
    }
    while (fgets(line, sizeof line, document) != NULL) {
        if (strncmp(line, "```", 3) == 0) {
            inside = strncmp(line, "```vectors", 10) == 0;
        } else if (inside) {
            if (!agrees(line, &model, &state)) {
                (void)printf("differs: %s", line);
                return 1;
            }
            compared++;
        }
    }
    (void)fclose(document);
    (void)printf("%d documented vectors, bit for bit\n", compared);
    return compared == 0;
}
