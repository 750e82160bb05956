/* Answers a story as the core does: story MODEL.fpm CHARGED.fpm < story.txt > answers.txt; see bindings/c/story. */
#include "common.h"

static model_file files[2];
static fingerpad_model model;
static fingerpad_state plain;
static fingerpad_spin_state spin;
static fingerpad_force_state force_state;
static fingerpad_contact contact;
static fingerpad_surroundings around;
static fingerpad_watch watch;
/* The first model with tissue that relaxes. */
static fingerpad_model soft;
static fingerpad_relaxing_state soft_plain;
static fingerpad_relaxing_spin_state soft_spin;
static fingerpad_frame_contact bed_framed, soft_framed;
static model_file pad_file;
static fingerpad_pad pad;
static fingerpad_pad_info pad_info;
static fingerpad_body body;
static fingerpad_relaxing_pad_state pad_room;
static fingerpad_pad_state *const pad_state = &pad_room.state;
static fingerpad_relaxing_frame_contact framed;

/* The words of a line behind its name; a line has at most eleven. */
static size_t words_of(const char *line, float *numbers)
{
    size_t count = 0;
    char *end;
    while (count < 11) {
        const unsigned long word = strtoul(line, &end, 16);
        if (end == line) {
            break;
        }
        numbers[count++] = number((uint32_t)word);
        line = end;
    }
    return count;
}

static void print_words(const float *numbers, size_t count)
{
    size_t i;
    for (i = 0; i < count; i++) {
        (void)printf(" %08" PRIx32, bits(numbers[i]));
    }
}

static void print_response(const fingerpad_response *r)
{
    const float numbers[17] = {r->normal_force_n,
                               r->friction_x_n,
                               r->friction_y_n,
                               r->tangential_friction_x_n,
                               r->tangential_friction_y_n,
                               r->stick_ratio,
                               r->friction_limit_n,
                               r->slip_margin,
                               r->slip_margin_relaxed,
                               r->spin_moment_n_mm,
                               r->tilt_moment_x_n_mm,
                               r->tilt_moment_y_n_mm,
                               r->pressure_centre_x_mm,
                               r->pressure_centre_y_mm,
                               r->contact_area_mm2,
                               r->band_normal_n,
                               r->band_friction_n};
    print_words(numbers, 17);
    (void)printf(" %d %x", (int)r->regime, (unsigned)r->status);
}

static void print_forces(const fingerpad_force_response *r)
{
    const float numbers[9] = {r->normal_force_n,   r->friction_x_n,         r->friction_y_n,
                              r->friction_limit_n, r->slip_margin,          r->spin_moment_n_mm,
                              r->pressure_centre_x_mm, r->pressure_centre_y_mm, r->contact_area_mm2};
    print_words(numbers, 9);
    (void)printf(" %x", (unsigned)r->status);
}

static void print_motion(const fingerpad_motion *m)
{
    const float numbers[5] = {m->depth_mm, m->slide_x_mm, m->slide_y_mm, m->spin_rad, m->dt_s};
    print_words(numbers, 5);
}

static void use_model(unsigned k)
{
    fingerpad_watch_settings settings;
    must(fingerpad_model_load(&model, bytes_of(&files[k]), files[k].length), "model");
    must(fingerpad_state_init(&plain), "state");
    must(fingerpad_spin_state_init(&spin), "spin state");
    must(fingerpad_force_state_init(&force_state), "force state");
    must(fingerpad_contact_init(&contact), "contact");
    must(fingerpad_model_surroundings(&model, &around), "surroundings");
    must(fingerpad_watch_settings_default(&settings), "settings");
    must(fingerpad_watch_init(&watch, (uint8_t)k, settings), "watch");
    {
        static const fingerpad_branch branches[3] = {{1.0f, 0.004f}, {0.6f, 0.07f}, {0.6f, 1.4f}};
        must(fingerpad_model_load(&soft, bytes_of(&files[0]), files[0].length), "model");
        if (fingerpad_model_relax(&soft, branches, 3) != FINGERPAD_OK) {
            (void)printf("refused ");
        }
        must(fingerpad_relaxing_state_init(&soft_plain), "relaxing state");
        must(fingerpad_relaxing_spin_state_init(&soft_spin), "relaxing spin state");
    }
    (void)printf("0");
}

/* A batch of one more contact must do as the single steps do. */
static void compare_batch(fingerpad_state *states, fingerpad_spin_state *spins, fingerpad_motion m,
                          const fingerpad_response *one, const fingerpad_response *two)
{
    const float depth[2] = {m.depth_mm, m.depth_mm}, x[2] = {m.slide_x_mm, m.slide_x_mm};
    const float y[2] = {m.slide_y_mm, m.slide_y_mm}, turn[2] = {m.spin_rad, m.spin_rad};
    fingerpad_response many[2];
    fingerpad_motions motions;
    motions.count = 2;
    motions.depth_mm = depth;
    motions.slide_x_mm = x;
    motions.slide_y_mm = y;
    motions.spin_rad = turn;
    motions.dt_s = m.dt_s;
    must(fingerpad_step_batch(&model, states, &motions, many, 2), "batch");
    if (memcmp(&many[0], one, sizeof *one) != 0 || memcmp(&many[1], one, sizeof *one) != 0
        || memcmp(&states[1], &plain, sizeof plain) != 0) {
        (void)printf(" batch differs");
    }
    must(fingerpad_spin_step_batch(&model, spins, &motions, many, 2), "spin batch");
    if (memcmp(&many[0], two, sizeof *two) != 0 || memcmp(&many[1], two, sizeof *two) != 0
        || memcmp(&spins[1], &spin, sizeof spin) != 0) {
        (void)printf(" spin batch differs");
    }
}

static void step(const float *f)
{
    fingerpad_motion motion;
    fingerpad_response one, two, three;
    fingerpad_force_response forces;
    fingerpad_event events[FINGERPAD_EVENTS_A_LOOK];
    fingerpad_state states[2];
    fingerpad_spin_state spins[2];
    float reading_n[3], under_n[3];
    uint32_t count, i;
    motion.depth_mm = f[0];
    motion.slide_x_mm = f[1];
    motion.slide_y_mm = f[2];
    motion.spin_rad = f[3];
    motion.dt_s = f[4];
    states[0] = states[1] = plain;
    spins[0] = spins[1] = spin;
    must(fingerpad_step(&model, &plain, motion, &one), "step");
    must(fingerpad_spin_step(&model, &spin, motion, &two), "spin step");
    must(fingerpad_step_forces(&model, &force_state, motion, &forces), "step of forces");
    must(fingerpad_contact_step(&model, &contact, around, motion, &three), "step with effects");
    must(fingerpad_contact_reading(&model, &three, reading_n), "reading");
    must(fingerpad_contact_reading_under(&model, &contact, around, &three, under_n), "reading under surroundings");
    must(fingerpad_watch_look(&watch, &one, events, &count), "look");
    print_response(&one);
    print_response(&two);
    print_response(&three);
    print_forces(&forces);
    must(fingerpad_relaxing_step(&soft, &soft_plain, motion, &three), "relaxing step");
    print_response(&three);
    must(fingerpad_relaxing_spin_step(&soft, &soft_spin, motion, &three), "relaxing spin step");
    print_response(&three);
    print_words(reading_n, 3);
    print_words(under_n, 3);
    for (i = 0; i < count; i++) {
        (void)printf(" @%" PRIu32 " %d %d", events[i].tick, (int)events[i].finger, (int)events[i].change);
    }
    compare_batch(states, spins, motion, &one, &two);
}

static void driven(const char *line)
{
    fingerpad_drive drive;
    fingerpad_response response;
    fingerpad_motion motion;
    unsigned by_normal_force, by_friction;
    float f[11];
    int used = 0;
    if (sscanf(line, "%u %u%n", &by_normal_force, &by_friction, &used) != 2 || words_of(line + used, f) != 8) {
        (void)printf("not understood");
        return;
    }
    drive.by_normal_force = (uint16_t)by_normal_force;
    drive.by_friction = (uint16_t)by_friction;
    drive.depth_mm = f[0];
    drive.normal_force_n = f[1];
    drive.slide_x_mm = f[2];
    drive.slide_y_mm = f[3];
    drive.friction_x_n = f[4];
    drive.friction_y_n = f[5];
    drive.spin_rad = f[6];
    drive.dt_s = f[7];
    must(fingerpad_step_driven(&model, &plain, drive, &response, &motion), "driven step");
    print_response(&response);
    print_motion(&motion);
    must(fingerpad_spin_step_driven(&model, &spin, drive, &response, &motion), "driven spin step");
    print_response(&response);
    print_motion(&motion);
    must(fingerpad_relaxing_step_driven(&soft, &soft_plain, drive, &response, &motion), "driven relaxing step");
    print_response(&response);
    print_motion(&motion);
    must(fingerpad_relaxing_spin_step_driven(&soft, &soft_spin, drive, &response, &motion), "driven relaxing spin step");
    print_response(&response);
    print_motion(&motion);
}

static void print_gradient(const fingerpad_gradient *g)
{
    print_words(g->normal_n_mm, 3);
    print_words(g->friction_x_n_mm, 3);
    print_words(g->friction_y_n_mm, 3);
}

static void gradient(const float *f)
{
    fingerpad_gradient g;
    must(fingerpad_state_gradient(&model, &plain, f[0], f[1], f[2], &g), "gradient");
    print_gradient(&g);
    must(fingerpad_spin_state_gradient(&model, &spin, f[0], f[1], f[2], &g), "gradient");
    print_gradient(&g);
    must(fingerpad_relaxing_state_gradient(&soft, &soft_plain, f[0], f[1], f[2], &g), "gradient");
    print_gradient(&g);
    must(fingerpad_relaxing_spin_state_gradient(&soft, &soft_spin, f[0], f[1], f[2], &g), "gradient");
    print_gradient(&g);
}

static void print_bytes(const uint8_t *bytes, size_t count)
{
    size_t i;
    (void)printf(" ");
    for (i = 0; i < count; i++) {
        (void)printf("%02x", (unsigned)bytes[i]);
    }
}

static void save(void)
{
    uint8_t bytes[FINGERPAD_STATE_BYTES], more[FINGERPAD_SPIN_STATE_BYTES];
    must(fingerpad_state_save(&model, &plain, bytes, sizeof bytes), "save");
    must(fingerpad_spin_state_save(&model, &spin, more, sizeof more), "save");
    (void)memset(&plain, 0, sizeof plain);
    (void)memset(&spin, 0, sizeof spin);
    must(fingerpad_state_restore(&model, &plain, bytes, sizeof bytes), "restore");
    must(fingerpad_spin_state_restore(&model, &spin, more, sizeof more), "restore");
    print_bytes(bytes, sizeof bytes);
    print_bytes(more, sizeof more);
    {
        uint8_t kept[FINGERPAD_RELAXING_STATE_BYTES], spun[FINGERPAD_RELAXING_SPIN_STATE_BYTES];
        must(fingerpad_relaxing_state_save(&soft, &soft_plain, kept, sizeof kept), "save");
        must(fingerpad_relaxing_spin_state_save(&soft, &soft_spin, spun, sizeof spun), "save");
        (void)memset(&soft_plain, 0, sizeof soft_plain);
        (void)memset(&soft_spin, 0, sizeof soft_spin);
        must(fingerpad_relaxing_state_restore(&soft, &soft_plain, kept, sizeof kept), "restore");
        must(fingerpad_relaxing_spin_state_restore(&soft, &soft_spin, spun, sizeof spun), "restore");
        print_bytes(kept, sizeof kept);
        print_bytes(spun, sizeof spun);
    }
}

static void factor(float f)
{
    const int32_t code = fingerpad_state_set_strength_factor(&plain, f);
    if (fingerpad_force_state_set_strength_factor(&force_state, f) != code
        || fingerpad_spin_state_set_strength_factor(&spin, f) != code
        || fingerpad_relaxing_state_set_strength_factor(&soft_plain, f) != code
        || fingerpad_relaxing_spin_state_set_strength_factor(&soft_spin, f) != code
        || fingerpad_contact_set_strength_factor(&contact, f) != code) {
        (void)printf("the states differ ");
    }
    (void)printf("%d", (int)code);
}

static void grip(const float *f)
{
    fingerpad_grip least;
    float numbers[2];
    must(fingerpad_least_grip(&model, f[0], f[1], f[2], f[3], &least), "grip");
    numbers[0] = least.depth_mm;
    numbers[1] = least.normal_force_n;
    print_words(numbers, 2);
    (void)printf(" %x", (unsigned)least.status);
}

static void tune_pad(const float *f)
{
    (void)printf("%d", (int)fingerpad_pad_tune(&pad, f[0], f[1], f[2]));
}

static void begin_over(const char *line)
{
    fingerpad_body wanted;
    fingerpad_pad_motion nothing = {0.0f, 0.0f, 0.0f, 0.0f, 30.0f, 0.0f, 1e-3f};
    fingerpad_response r;
    float f[11];
    unsigned kind;
    int used = 0;
    int32_t code;
    if (sscanf(line, "%x%n", &kind, &used) != 1 || words_of(line + used, f) != 5) {
        (void)printf("not understood");
        return;
    }
    wanted.kind = kind;
    wanted.radius_mm = f[0];
    wanted.axis_deg = f[1];
    wanted.angle_deg = f[2];
    /* Whether the body can be is asked with a copy, so that the contact goes on over the old one where it cannot. */
    {
        fingerpad_relaxing_pad_state tried = pad_room;
        code = fingerpad_pad_step(&pad, &tried.state, wanted, nothing, &r);
    }
    if (code == FINGERPAD_OK) {
        body = wanted;
        code = kind == FINGERPAD_BODY_PLANE ? fingerpad_relaxing_pad_state_init(&pad, &pad_room)
                                            : fingerpad_relaxing_pad_state_init_over(&pad, &pad_room, f[3], f[4]);
    }
    (void)printf("%d", (int)code);
}

static void pad_step(const float *f)
{
    fingerpad_pad_motion motion;
    fingerpad_response r;
    motion.depth_mm = f[0];
    motion.slide_x_mm = f[1];
    motion.slide_y_mm = f[2];
    motion.spin_rad = f[3];
    motion.pitch_deg = f[4];
    motion.roll_deg = f[5];
    motion.dt_s = f[6];
    must(fingerpad_pad_step(&pad, pad_state, body, motion, &r), "step of the pad");
    print_response(&r);
}

static fingerpad_shape shape_of(const char *line)
{
    fingerpad_shape shape;
    float f[11];
    unsigned kind;
    int used = 0;
    if (sscanf(line, "%x%n", &kind, &used) != 1 || words_of(line + used, f) != 5) {
        (void)printf("not understood ");
        exit(2);
    }
    shape.kind = kind;
    shape.size_mm[0] = (double)f[0];
    shape.size_mm[1] = (double)f[1];
    shape.size_mm[2] = (double)f[2];
    shape.edge_radius_mm = (double)f[3];
    shape.angle_deg = (double)f[4];
    return shape;
}

static fingerpad_pose pose_of(const float *f)
{
    fingerpad_pose pose;
    int i;
    for (i = 0; i < 3; i++) {
        pose.position_mm[i] = (double)f[i];
    }
    for (i = 0; i < 4; i++) {
        pose.quaternion[i] = (double)f[3 + i];
    }
    return pose;
}

static void print_felt(const fingerpad_frame_response *r)
{
    const float numbers[3] = {r->depth_mm, r->pitch_deg, r->roll_deg};
    print_words(r->on_finger.force_n, 3);
    print_words(r->on_finger.moment_n_mm, 3);
    print_words(r->on_body.force_n, 3);
    print_words(r->on_body.moment_n_mm, 3);
    print_words(numbers, 3);
    (void)printf(" %u", (unsigned)r->face);
    print_response(&r->response);
}

static void pad_pose(const float *f)
{
    const fingerpad_pose pose = pose_of(f);
    fingerpad_frame_response r;
    must(fingerpad_frame_step_pad(&pad, &framed.contact, &pose, f[7], &r), "step in frames");
    print_felt(&r);
}

/* Contacts of beds in frames; the old ones stay where the shape cannot be. */
static void bed_shape(const char *line)
{
    const fingerpad_shape shape = shape_of(line);
    const int32_t code = fingerpad_frame_init_bed(&model, shape, &bed_framed);
    if (fingerpad_frame_init_bed(&soft, shape, &soft_framed) != code) {
        (void)printf("the two differ ");
    }
    (void)printf("%d", (int)code);
}

static void bed_pose(const float *f)
{
    const fingerpad_pose pose = pose_of(f);
    fingerpad_frame_response r;
    must(fingerpad_frame_step_bed(&model, &bed_framed, &pose, f[7], &r), "step of a bed in frames");
    print_felt(&r);
    must(fingerpad_frame_step_bed(&soft, &soft_framed, &pose, f[7], &r), "step of a bed that relaxes in frames");
    print_felt(&r);
}

static void print_patches(void)
{
    static fingerpad_patch patches[FINGERPAD_PATCHES_MAX];
    uint32_t i;
    must(fingerpad_pad_patches(&pad, pad_state, body, patches, FINGERPAD_PATCHES_MAX), "patches");
    for (i = 0; i < pad_info.patches; i++) {
        const fingerpad_patch *p = &patches[i];
        print_words(p->place_mm, 3);
        print_words(&p->pressure_mpa, 1);
        print_words(p->traction_mpa, 2);
        print_words(&p->contact_area_mm2, 1);
        print_words(&p->stick_ratio, 1);
        print_words(&p->used, 1);
    }
}

static void save_pad(void)
{
    static uint8_t bytes[FINGERPAD_RELAXING_PAD_STATE_BYTES];
    must(fingerpad_pad_state_save(&pad, pad_state, bytes, sizeof bytes), "save the pad's state");
    (void)memset(&pad_room, 0, sizeof pad_room);
    must(fingerpad_relaxing_pad_state_init(&pad, &pad_room), "room for the pad's state");
    must(fingerpad_pad_state_restore(&pad, pad_state, bytes, pad_info.state_bytes), "restore the pad's state");
    print_bytes(bytes, pad_info.state_bytes);
}

/* The next words of a pad's file; those of another pad begin after it was loaded. */
static void take_words(const float *words, size_t count)
{
    (void)memcpy((uint8_t *)pad_file.words + pad_file.length, words, 4 * count);
    pad_file.length += 4 * count;
    (void)printf("0");
}

/* The file ends where its header says, less than a word before the last one handed over. */
static void use_pad(void)
{
    const fingerpad_body plane = {FINGERPAD_BODY_PLANE, 0.0f, 0.0f, 0.0f};
    uint32_t length;
    (void)memcpy(&length, bytes_of(&pad_file) + 8, sizeof length);
    must(fingerpad_relaxing_pad_load(&pad, bytes_of(&pad_file), length), "pad");
    pad_file.length = 0;
    must(fingerpad_pad_describe(&pad, &pad_info), "info of the pad");
    must(fingerpad_relaxing_pad_state_init(&pad, &pad_room), "state of the pad");
    body = plane;
    (void)printf("%" PRIu32, pad_info.patches);
}

/* Answers what is asked of the pad; 0 if the request is none of its. */
static int answer_of_pad(const char *name, const char *rest, const float *f, size_t count)
{
    if (strcmp(name, "pad-words") == 0) {
        take_words(f, count);
    } else if (strcmp(name, "pad-load") == 0) {
        use_pad();
    } else if (strcmp(name, "pad") == 0) {
        tune_pad(f);
    } else if (strcmp(name, "body") == 0) {
        begin_over(rest);
    } else if (strcmp(name, "pad-factor") == 0) {
        (void)printf("%d", (int)fingerpad_pad_state_set_strength_factor(pad_state, f[0]));
    } else if (strcmp(name, "pad-step") == 0) {
        pad_step(f);
    } else if (strcmp(name, "shape") == 0) {
        (void)printf("%d", (int)fingerpad_relaxing_frame_init_pad(&pad, shape_of(rest), &framed));
    } else if (strcmp(name, "pose") == 0) {
        pad_pose(f);
    } else if (strcmp(name, "patches") == 0) {
        print_patches();
    } else if (strcmp(name, "pad-save") == 0) {
        save_pad();
    } else {
        return 0;
    }
    return 1;
}

static void answer(const char *name, const char *rest)
{
    float f[11] = {0};
    const size_t count = words_of(rest, f);
    if (strcmp(name, "model") == 0) {
        use_model(rest[1] == '1');
    } else if (strcmp(name, "tune") == 0) {
        const int32_t code = fingerpad_model_tune(&model, f[0], f[1], f[2]);
        if (fingerpad_model_tune(&soft, f[0], f[1], f[2]) != code) {
            (void)printf("the two differ ");
        }
        (void)printf("%d", (int)code);
    } else if (strcmp(name, "factor") == 0) {
        factor(f[0]);
    } else if (strcmp(name, "around") == 0) {
        const fingerpad_surroundings given = {f[0], f[1], f[2], f[3], f[4], f[5], f[6], {f[7], f[8], f[9], f[10]}};
        around = given;
        (void)printf("0");
    } else if (strcmp(name, "step") == 0) {
        step(f);
    } else if (strcmp(name, "driven") == 0) {
        driven(rest);
    } else if (strcmp(name, "gradient") == 0) {
        gradient(f);
    } else if (strcmp(name, "grip") == 0) {
        grip(f);
    } else if (strcmp(name, "bed-shape") == 0) {
        bed_shape(rest);
    } else if (strcmp(name, "bed-pose") == 0) {
        bed_pose(f);
    } else if (strcmp(name, "save") == 0) {
        save();
    } else if (!answer_of_pad(name, rest, f, count)) {
        (void)printf("not understood: %s", name);
    }
    (void)printf("\n");
}

int main(int argc, char **argv)
{
    char line[512], name[16];
    int used;
    if (argc != 3) {
        return 2;
    }
    read_file(&files[0], argv[1]);
    read_file(&files[1], argv[2]);
    while (fgets(line, sizeof line, stdin) != NULL) {
        if (sscanf(line, "%15s%n", name, &used) == 1) {
            answer(name, line + used);
        }
    }
    return 0;
}
