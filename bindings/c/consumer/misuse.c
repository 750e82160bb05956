/* What a caller gets wrong is answered by a code, and changes nothing: misuse MODEL.fpm CHARGED.fpm
 * CHARGED.fpm is the story's model with tables over a voltage; the story's pads lie beside it. */
#include "common.h"

static int failures;

static void expect(int32_t got, int32_t want, const char *what)
{
    if (got != want) {
        (void)printf("%s: %d (%s), wanted %d\n", what, (int)got, fingerpad_error_text(got), (int)want);
        failures++;
    }
}

static void expect_true(int holds, const char *what)
{
    if (!holds) {
        (void)printf("not so: %s\n", what);
        failures++;
    }
}

static const fingerpad_motion pressed = {0.8f, 0.01f, 0.0f, 0.0f, 1e-3f};

static void files(const model_file *good)
{
    static model_file other;
    fingerpad_model model;
    fingerpad_state state;
    fingerpad_response r;
    size_t length;
    other = *good;
    for (length = 0; length < good->length; length++) {
        expect_true(fingerpad_model_load(&model, bytes_of(good), length) != FINGERPAD_OK, "a truncated file is refused");
    }
    expect(fingerpad_model_load(&model, bytes_of(good), length + 1), FINGERPAD_LENGTH, "a byte too many");
    ((uint8_t *)other.words)[0] ^= 1;
    expect(fingerpad_model_load(&model, bytes_of(&other), length), FINGERPAD_NOT_A_MODEL, "another start");
    other = *good;
    ((uint8_t *)other.words)[4] ^= 1;
    expect(fingerpad_model_load(&model, bytes_of(&other), length), FINGERPAD_VERSION_UNKNOWN, "another version");
    other = *good;
    ((uint8_t *)other.words)[200] ^= 1;
    expect(fingerpad_model_load(&model, bytes_of(&other), length), FINGERPAD_CHECKSUM, "a flipped bit");
    must(fingerpad_state_init(&state), "state");
    expect(fingerpad_step(&model, &state, pressed, &r), FINGERPAD_NOT_SET_UP, "a step of a model that was refused");
    (void)memmove((uint8_t *)other.words + 1, bytes_of(good), length);
    expect(fingerpad_model_load(&model, bytes_of(&other) + 1, length), FINGERPAD_ALIGNMENT, "a file at an odd address");
    expect(fingerpad_model_load(&model, NULL, length), FINGERPAD_NULL, "no file");
    expect(fingerpad_model_load(NULL, bytes_of(good), length), FINGERPAD_NULL, "no model");
}

static void handles(const model_file *file)
{
    fingerpad_model model, zeroed;
    fingerpad_state state, before;
    fingerpad_spin_state spin;
    fingerpad_force_state forces;
    fingerpad_force_response f;
    fingerpad_contact contact;
    fingerpad_watch watch;
    fingerpad_response r;
    fingerpad_event events[FINGERPAD_EVENTS_A_LOOK];
    fingerpad_surroundings around;
    fingerpad_model_info info;
    uint32_t count;
    (void)memset(&zeroed, 0, sizeof zeroed);
    (void)memset(&state, 0, sizeof state);
    (void)memset(&spin, 0, sizeof spin);
    (void)memset(&forces, 0, sizeof forces);
    (void)memset(&contact, 0, sizeof contact);
    (void)memset(&watch, 0, sizeof watch);
    must(fingerpad_surroundings_default(&around), "surroundings");
    must(fingerpad_model_load(&model, bytes_of(file), file->length), "model");
    expect(fingerpad_step(&model, &state, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed state");
    expect(fingerpad_spin_step(&model, &spin, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed spin state");
    expect(fingerpad_step_forces(&model, &forces, pressed, &f), FINGERPAD_NOT_SET_UP, "a zeroed state of forces");
    must(fingerpad_force_state_init(&forces), "state of forces");
    expect(fingerpad_step_forces(&model, &forces, pressed, NULL), FINGERPAD_NULL, "no response of forces");
    expect(fingerpad_step_forces(&zeroed, &forces, pressed, &f), FINGERPAD_NOT_SET_UP, "forces of a zeroed model");
    expect(fingerpad_force_state_set_strength_factor(&forces, 6.0f), FINGERPAD_RANGE, "a factor out of range");
    expect(fingerpad_contact_step(&model, &contact, around, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed contact");
    must(fingerpad_state_init(&state), "state");
    must(fingerpad_step(&model, &state, pressed, &r), "step");
    expect(fingerpad_watch_look(&watch, &r, events, &count), FINGERPAD_NOT_SET_UP, "a zeroed watch");
    expect(fingerpad_step(&zeroed, &state, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed model");
    expect(fingerpad_model_describe(&zeroed, &info), FINGERPAD_NOT_SET_UP, "a zeroed model described");
    expect(fingerpad_model_tune(&zeroed, 1.0f, 1.0f, 1.0f), FINGERPAD_NOT_SET_UP, "a zeroed model tuned");
    before = state;
    expect(fingerpad_step(&model, NULL, pressed, &r), FINGERPAD_NULL, "no state");
    expect(fingerpad_step(NULL, &state, pressed, &r), FINGERPAD_NULL, "no model");
    expect(fingerpad_step(&model, &state, pressed, NULL), FINGERPAD_NULL, "no response");
    expect_true(memcmp(&before, &state, sizeof state) == 0, "a refused step leaves the state");
    must(fingerpad_model_describe(&model, &info), "info");
    expect_true(info.meta_length > 0 && info.meta[0] == '{', "the description is JSON");
    expect_true(info.pitch_deg == 30.0f && info.roll_deg == 0.0f, "the pose that the bed is of");
    must(fingerpad_model_unload(&model), "unload");
    expect(fingerpad_step(&model, &state, pressed, &r), FINGERPAD_NOT_SET_UP, "a model that was unloaded");
    expect_true(memcmp(&before, &state, sizeof state) == 0, "a refused step leaves the state");
}

static void misaligned(const fingerpad_model *model)
{
    /* Room for a state and a response at an odd address. */
    uint64_t room[64];
    uint8_t *odd = (uint8_t *)room + 1;
    fingerpad_state state;
    fingerpad_response r;
    must(fingerpad_state_init(&state), "state");
    expect(fingerpad_state_init((fingerpad_state *)(void *)odd), FINGERPAD_ALIGNMENT, "a state at an odd address");
    expect(fingerpad_step(model, &state, pressed, (fingerpad_response *)(void *)odd), FINGERPAD_ALIGNMENT,
           "a response at an odd address");
    expect(fingerpad_step((const fingerpad_model *)(void *)odd, &state, pressed, &r), FINGERPAD_ALIGNMENT,
           "a model at an odd address");
}

static void buffers(const fingerpad_model *model)
{
    fingerpad_state state, restored;
    fingerpad_spin_state spin;
    fingerpad_response r;
    uint8_t bytes[FINGERPAD_STATE_BYTES];
    must(fingerpad_state_init(&state), "state");
    must(fingerpad_spin_state_init(&spin), "spin state");
    must(fingerpad_step(model, &state, pressed, &r), "step");
    restored = state;
    expect(fingerpad_state_save(model, &state, bytes, sizeof bytes - 1), FINGERPAD_BUFFER, "a buffer too small");
    expect(fingerpad_state_save(model, &state, NULL, sizeof bytes), FINGERPAD_NULL, "no buffer");
    must(fingerpad_state_save(model, &state, bytes, sizeof bytes), "save");
    expect(fingerpad_state_restore(model, &restored, bytes, sizeof bytes - 1), FINGERPAD_LENGTH, "a cut state");
    expect(fingerpad_spin_state_restore(model, &spin, bytes, sizeof bytes), FINGERPAD_LENGTH, "another kind of state");
    bytes[20] ^= 1;
    expect(fingerpad_state_restore(model, &restored, bytes, sizeof bytes), FINGERPAD_CHECKSUM, "a damaged state");
    expect_true(memcmp(&restored, &state, sizeof state) == 0, "a refused restore leaves the state");
}

static void batches(const fingerpad_model *model)
{
    float numbers[2] = {0.8f, 0.8f};
    fingerpad_state states[2];
    fingerpad_response many[2];
    fingerpad_motions motions;
    must(fingerpad_state_init(&states[0]), "state");
    (void)memset(&states[1], 0, sizeof states[1]);
    motions.count = 2;
    motions.depth_mm = motions.slide_x_mm = motions.slide_y_mm = numbers;
    motions.spin_rad = NULL;
    motions.dt_s = 1e-3f;
    expect(fingerpad_step_batch(model, states, &motions, many, 2), FINGERPAD_NOT_SET_UP, "a zeroed state in a batch");
    must(fingerpad_state_init(&states[1]), "state");
    expect_true(memcmp(&states[0], &states[1], sizeof states[0]) == 0, "a refused batch moves nothing");
    expect(fingerpad_step_batch(model, states, &motions, many, 1), FINGERPAD_BUFFER, "arrays of another length");
    expect(fingerpad_step_batch(model, states, NULL, many, 2), FINGERPAD_NULL, "no motions");
    motions.depth_mm = NULL;
    expect(fingerpad_step_batch(model, states, &motions, many, 2), FINGERPAD_NULL, "no depths");
}

static void numbers(fingerpad_model *model)
{
    fingerpad_state state;
    fingerpad_response r, clean;
    fingerpad_motion motion = pressed;
    fingerpad_watch watch;
    fingerpad_watch_settings settings;
    fingerpad_event events[FINGERPAD_EVENTS_A_LOOK];
    uint32_t count;
    must(fingerpad_state_init(&state), "state");
    must(fingerpad_step(model, &state, pressed, &clean), "step");
    motion.depth_mm = NAN;
    motion.slide_x_mm = 0.0f;
    must(fingerpad_step(model, &state, motion, &r), "step");
    expect_true((r.status & FINGERPAD_STATUS_BAD_INPUT) != 0, "NaN is flagged");
    expect_true(bits(r.normal_force_n) == bits(clean.normal_force_n), "and the depth stays where it was");
    expect(fingerpad_state_set_strength_factor(&state, NAN), FINGERPAD_RANGE, "a strength factor of NaN");
    expect(fingerpad_state_set_strength_factor(&state, 9.0f), FINGERPAD_RANGE, "a strength factor of 9");
    expect(fingerpad_model_tune(model, NAN, 1.0f, 1.0f), FINGERPAD_RANGE, "a size of NaN");
    must(fingerpad_watch_settings_default(&settings), "settings");
    must(fingerpad_watch_init(&watch, 0, settings), "watch");
    r.regime = 77;
    expect(fingerpad_watch_look(&watch, &r, events, &count), FINGERPAD_RANGE, "a regime that is none");
    settings.restick = NAN;
    expect(fingerpad_watch_init(&watch, 0, settings), FINGERPAD_RANGE, "a threshold of NaN");
}

static uint32_t noise_seed;

static float noise(void)
{
    noise_seed = noise_seed * 1664525u + 1013904223u;
    return ((float)(noise_seed >> 8) / 16777216.0f - 0.5f) / 64.0f;
}

static uint32_t turned(uint32_t digest, uint32_t word)
{
    return ((digest << 5) | (digest >> 27)) ^ word;
}

/* The observer of the margin: what it refuses, and the bits of the core along the readings of its test (core/tests/all/margin.rs). */
static void observers(const fingerpad_model *model)
{
    static fingerpad_margin_observer observer;
    fingerpad_margin_settings settings;
    fingerpad_margin_reading reading;
    fingerpad_margin m;
    uint32_t digest = 0;
    int k;
    (void)memset(&reading, 0, sizeof reading);
    expect(fingerpad_margin_step(&observer, &reading, &m), FINGERPAD_NOT_SET_UP, "an observer of zeros");
    must(fingerpad_margin_settings_default(&settings), "settings");
    settings.confidence = NAN;
    expect(fingerpad_margin_init(model, settings, &observer), FINGERPAD_RANGE, "a confidence of NaN");
    must(fingerpad_margin_settings_default(&settings), "settings");
    expect(fingerpad_margin_init(NULL, settings, &observer), FINGERPAD_NULL, "no model");
    must(fingerpad_margin_init(model, settings, &observer), "observer");
    expect(fingerpad_margin_step(&observer, NULL, &m), FINGERPAD_NULL, "no reading");
    noise_seed = 7;
    for (k = 0; k < 600; k++) {
        const float press = (float)(k < 256 ? k : 256), pull = (float)(k > 300 ? k - 300 : 0);
        const float variance = 1.0f / 32768.0f;
        reading.normal_force_n = press / 512.0f + noise();
        reading.friction_x_n = pull / 1024.0f + noise();
        reading.friction_y_n = noise();
        reading.slide_x_mm = (k > 300 ? 1.0f / 128.0f : 0.0f) + noise();
        reading.slide_y_mm = noise();
        reading.stick_ratio = 1.0f - pull / 512.0f + noise();
        reading.stick_variance = k % 128 >= 64 ? 1.0f / 256.0f : 0.0f;
        reading.dt_s = k % 97 == 96 ? 0.0f : 1.0f / 1024.0f;
        reading.normal_variance_n2 = variance;
        reading.friction_covariance_n2[0] = reading.friction_covariance_n2[1] = variance;
        reading.slide_covariance_mm2[0] = reading.slide_covariance_mm2[1] = variance;
        must(fingerpad_margin_step(&observer, &reading, &m), "reading");
        digest = turned(digest, bits(m.strength_factor));
        digest = turned(digest, bits(m.strength_low));
        digest = turned(digest, bits(m.strength_high));
        digest = turned(digest, bits(m.slip_margin));
        digest = turned(digest, bits(m.margin_low));
        digest = turned(digest, bits(m.margin_high));
        digest = turned(digest, bits(m.slip_chance));
        digest = turned(digest, bits(m.stiffness_factor));
        digest = turned(digest, bits(m.information));
        digest = turned(turned(turned(digest, m.known), m.surface_changed), m.status);
    }
    expect_true(digest == 0xdebbcad0u, "an observer has the bits of the core");
}

/* A finger pressed to 0.8 mm and slid by 2 mm in small steps. */
static void slide(const fingerpad_model *model, fingerpad_surroundings around, fingerpad_contact *contact,
                  fingerpad_response *r)
{
    fingerpad_motion motion = pressed;
    int i;
    must(fingerpad_contact_init(contact), "contact");
    for (i = 0; i < 200; i++) {
        must(fingerpad_contact_step(model, contact, around, motion, r), "step");
    }
}

static void own_columns(const fingerpad_model *plain, const fingerpad_model *charged)
{
    fingerpad_model_info info;
    fingerpad_own_column column;
    fingerpad_surroundings around;
    fingerpad_contact contact, zeroed;
    fingerpad_response still, strong, r;
    float reading_n[3], under_n[3];
    must(fingerpad_model_describe(plain, &info), "info");
    expect_true(info.own_columns == 0, "the shipped model reads no column of the user's own");
    expect(fingerpad_model_own_column(plain, 0, &column), FINGERPAD_RANGE, "a column that is not there");
    must(fingerpad_model_describe(charged, &info), "info");
    expect_true(info.own_columns == 1, "the charged model reads one");
    must(fingerpad_model_own_column(charged, 0, &column), "column");
    expect_true(strcmp(column.name, "voltage_v") == 0 && strcmp(column.unit, "V") == 0, "its name and unit");
    expect_true(column.low == 0.0f && column.high == 200.0f && column.reference == 20.0f, "its range and reference");
    expect(fingerpad_model_own_column(charged, 1, &column), FINGERPAD_RANGE, "a column beyond the last");
    expect(fingerpad_model_own_column(charged, 0, NULL), FINGERPAD_NULL, "no column");
    must(fingerpad_model_surroundings(charged, &around), "surroundings");
    expect_true(around.own[0] == 20.0f && around.own[1] == 0.0f, "the model's reference state");
    slide(charged, around, &contact, &still);
    around.own[0] = 200.0f;
    slide(charged, around, &contact, &strong);
    expect_true(strong.friction_limit_n > 1.3f * still.friction_limit_n && strong.status == 0, "the voltage acts");
    must(fingerpad_contact_reading(charged, &strong, reading_n), "reading");
    must(fingerpad_contact_reading_under(charged, &contact, around, &strong, under_n), "reading");
    expect_true(under_n[0] > reading_n[0] + 0.02f, "the sensor's table is read under the voltage");
    around.own[0] = 400.0f;
    slide(charged, around, &contact, &r);
    expect_true((r.status & FINGERPAD_STATUS_EFFECT_HELD) != 0, "a voltage beyond the table is flagged");
    expect_true(r.friction_x_n == strong.friction_x_n, "and held at its end");
    (void)memset(&zeroed, 0, sizeof zeroed);
    expect(fingerpad_contact_reading_under(charged, &zeroed, around, &r, under_n), FINGERPAD_NOT_SET_UP,
           "a reading of a zeroed contact");
    expect(fingerpad_contact_reading_under(charged, &contact, around, &r, NULL), FINGERPAD_NULL, "no reading");
    r.regime = 77;
    expect(fingerpad_contact_reading_under(charged, &contact, around, &r, under_n), FINGERPAD_RANGE,
           "a reading of a regime that is none");
}

static const fingerpad_body plane = {FINGERPAD_BODY_PLANE, 0.0f, 0.0f, 0.0f};
static const fingerpad_body ball = {FINGERPAD_BODY_SPHERE, 20.0f, 0.0f, 0.0f};
static const fingerpad_pad_motion rolled = {0.8f, 0.01f, 0.0f, 0.0f, 40.0f, 5.0f, 1e-3f};

static void pad_files(const model_file *bed, const model_file *good)
{
    static model_file other;
    fingerpad_model model;
    fingerpad_pad pad;
    fingerpad_pad_state state;
    fingerpad_response r;
    size_t length;
    expect(fingerpad_model_load(&model, bytes_of(good), good->length), FINGERPAD_SECTION, "a pad loaded as a bed");
    expect(fingerpad_pad_load(&pad, bytes_of(bed), bed->length), FINGERPAD_SECTION, "a bed loaded as a pad");
    expect_true(strstr(fingerpad_error_text(FINGERPAD_SECTION), "fingerpad_pad_load") != NULL
                    && strstr(fingerpad_error_text(FINGERPAD_SECTION), "fingerpad_model_load") != NULL,
                "the text names the function to use");
    for (length = 0; length < good->length; length++) {
        expect_true(fingerpad_pad_load(&pad, bytes_of(good), length) != FINGERPAD_OK, "a truncated pad is refused");
    }
    other = *good;
    ((uint8_t *)other.words)[300] ^= 1;
    expect(fingerpad_pad_load(&pad, bytes_of(&other), length), FINGERPAD_CHECKSUM, "a flipped bit of a pad");
    expect(fingerpad_pad_describe(&pad, NULL), FINGERPAD_NOT_SET_UP, "a pad that was refused");
    (void)memmove((uint8_t *)other.words + 1, bytes_of(good), length);
    expect(fingerpad_pad_load(&pad, bytes_of(&other) + 1, length), FINGERPAD_ALIGNMENT, "a pad at an odd address");
    expect(fingerpad_pad_load(&pad, NULL, length), FINGERPAD_NULL, "no file of a pad");
    expect(fingerpad_pad_load(NULL, bytes_of(good), length), FINGERPAD_NULL, "no pad");
    must(fingerpad_pad_load(&pad, bytes_of(good), length), PAD_NAME);
    must(fingerpad_pad_state_init(&pad, &state), "state of the pad");
    must(fingerpad_pad_unload(&pad), "unload");
    expect(fingerpad_pad_step(&pad, &state, plane, rolled, &r), FINGERPAD_NOT_SET_UP, "a pad that was unloaded");
}

static void pad_handles(const fingerpad_pad *pad)
{
    uint64_t room[256];
    uint8_t *const odd = (uint8_t *)room + 1;
    fingerpad_pad zeroed;
    fingerpad_pad_state state, before;
    fingerpad_pad_info info;
    fingerpad_response r;
    fingerpad_patch patches[FINGERPAD_PATCHES_MAX];
    float place_mm[3];
    (void)memset(&zeroed, 0, sizeof zeroed);
    (void)memset(&state, 0, sizeof state);
    expect(fingerpad_pad_step(pad, &state, plane, rolled, &r), FINGERPAD_NOT_SET_UP, "a zeroed state of a pad");
    expect(fingerpad_pad_patches(pad, &state, plane, patches, 64), FINGERPAD_NOT_SET_UP, "patches of a zeroed state");
    expect(fingerpad_pad_state_set_strength_factor(&state, 1.0f), FINGERPAD_NOT_SET_UP, "strength of a zeroed state");
    expect(fingerpad_pad_state_init(&zeroed, &state), FINGERPAD_NOT_SET_UP, "a state of a zeroed pad");
    expect(fingerpad_pad_state_init_over(&zeroed, &state, 30.0f, 0.0f), FINGERPAD_NOT_SET_UP, "the same over a body");
    expect(fingerpad_pad_tune(&zeroed, 1.0f, 1.0f, 1.0f), FINGERPAD_NOT_SET_UP, "a zeroed pad tuned");
    expect(fingerpad_pad_first_touch(&zeroed, 30.0f, 0.0f, place_mm), FINGERPAD_NOT_SET_UP, "first touch of a zeroed pad");
    must(fingerpad_pad_describe(pad, &info), "info of the pad");
    expect_true(info.patches == 37 && info.roll_max_deg == 30.0f && info.neutral_pitch_deg == 30.0f, "what the pad is");
    expect_true(info.depth_max_mm > 4.0f && info.meta_length > 0 && info.meta[0] == '{', "its depth and description");
    must(fingerpad_pad_state_init(pad, &state), "state of the pad");
    must(fingerpad_pad_step(pad, &state, plane, rolled, &r), "step of the pad");
    before = state;
    expect(fingerpad_pad_step(pad, NULL, plane, rolled, &r), FINGERPAD_NULL, "no state of a pad");
    expect(fingerpad_pad_step(NULL, &state, plane, rolled, &r), FINGERPAD_NULL, "no pad to step");
    expect(fingerpad_pad_step(pad, &state, plane, rolled, NULL), FINGERPAD_NULL, "no response of a pad");
    expect(fingerpad_pad_state_init(pad, (fingerpad_pad_state *)(void *)odd), FINGERPAD_ALIGNMENT, "a state at an odd address");
    expect(fingerpad_pad_step((const fingerpad_pad *)(void *)odd, &state, plane, rolled, &r), FINGERPAD_ALIGNMENT,
           "a pad at an odd address");
    expect(fingerpad_pad_step(pad, &state, plane, rolled, (fingerpad_response *)(void *)odd), FINGERPAD_ALIGNMENT,
           "a response at an odd address");
    expect(fingerpad_pad_patches(pad, &state, plane, (fingerpad_patch *)(void *)odd, 64), FINGERPAD_ALIGNMENT,
           "patches at an odd address");
    expect(fingerpad_pad_patches(pad, &state, plane, NULL, 64), FINGERPAD_NULL, "no patches");
    expect(fingerpad_pad_patches(pad, &state, plane, patches, info.patches - 1), FINGERPAD_BUFFER, "too few patches");
    expect(fingerpad_pad_first_touch(pad, 30.0f, 0.0f, NULL), FINGERPAD_NULL, "no place");
    expect_true(memcmp(&before, &state, sizeof state) == 0, "a refused step leaves the state");
}

static void pads_of_other_sizes(const fingerpad_pad *few, const fingerpad_pad *many)
{
    fingerpad_pad_state small, large, before;
    fingerpad_pad_info info;
    fingerpad_response r;
    fingerpad_patch patches[FINGERPAD_PATCHES_MAX];
    uint8_t bytes[FINGERPAD_PAD_STATE_BYTES];
    must(fingerpad_pad_describe(many, &info), "info of the larger pad");
    expect_true(info.patches == 57 && info.state_bytes == FINGERPAD_PAD_STATE_BYTES, "a pad of 57 patches");
    must(fingerpad_pad_state_init(few, &small), "state of the smaller pad");
    must(fingerpad_pad_state_init_over(many, &large, 40.0f, 5.0f), "state of the larger pad");
    must(fingerpad_pad_step(many, &large, ball, rolled, &r), "step of the larger pad");
    before = small;
    expect(fingerpad_pad_step(many, &small, ball, rolled, &r), FINGERPAD_NOT_SET_UP, "a state of a smaller pad");
    expect(fingerpad_pad_patches(many, &small, ball, patches, 64), FINGERPAD_NOT_SET_UP, "patches of a smaller pad");
    expect_true(memcmp(&before, &small, sizeof small) == 0, "a refused step leaves the state");
    expect(fingerpad_pad_step(few, &large, ball, rolled, &r), FINGERPAD_NOT_SET_UP, "a state of a larger pad");
    must(fingerpad_pad_state_save(many, &large, bytes, sizeof bytes), "save the state of the larger pad");
    expect(fingerpad_pad_state_restore(few, &small, bytes, sizeof bytes), FINGERPAD_LENGTH, "a saved state of a larger pad");
    must(fingerpad_pad_state_restore(many, &small, bytes, sizeof bytes), "restore the state of the larger pad");
    expect_true(memcmp(&large, &small, sizeof small) == 0, "the same state");
    must(fingerpad_pad_describe(few, &info), "info of the smaller pad");
    must(fingerpad_pad_state_init(few, &small), "state of the smaller pad");
    must(fingerpad_pad_state_save(few, &small, bytes, info.state_bytes), "save the state of the smaller pad");
    bytes[5] ^= 1;
    expect(fingerpad_pad_state_restore(few, &large, bytes, info.state_bytes), FINGERPAD_CHECKSUM, "a damaged state");
}

static void pad_buffers(fingerpad_pad *pad)
{
    fingerpad_pad_info info;
    fingerpad_pad_state state, restored;
    fingerpad_response r;
    uint8_t bytes[FINGERPAD_PAD_STATE_BYTES];
    must(fingerpad_pad_state_init_over(pad, &state, 40.0f, 5.0f), "state of the pad");
    must(fingerpad_pad_step(pad, &state, ball, rolled, &r), "step of the pad");
    must(fingerpad_pad_describe(pad, &info), "info of the pad");
    restored = state;
    expect(fingerpad_pad_state_save(pad, &state, bytes, info.state_bytes - 1), FINGERPAD_BUFFER, "a buffer too small");
    expect(fingerpad_pad_state_save(pad, &state, NULL, sizeof bytes), FINGERPAD_NULL, "no buffer");
    must(fingerpad_pad_state_save(pad, &state, bytes, sizeof bytes), "save the pad's state");
    expect(fingerpad_pad_state_restore(pad, &restored, bytes, info.state_bytes - 1), FINGERPAD_LENGTH, "a cut state of a pad");
    bytes[20] ^= 1;
    expect(fingerpad_pad_state_restore(pad, &restored, bytes, info.state_bytes), FINGERPAD_CHECKSUM, "a damaged state of a pad");
    expect_true(memcmp(&restored, &state, sizeof state) == 0, "a refused restore leaves the state");
}

static void pad_bodies(const fingerpad_pad *pad)
{
    static const fingerpad_body refused[] = {
        {7, 20.0f, 0.0f, 0.0f},
        {FINGERPAD_BODY_SPHERE, 0.0f, 0.0f, 0.0f},
        {FINGERPAD_BODY_SPHERE, NAN, 0.0f, 0.0f},
        {FINGERPAD_BODY_SPHERE, 0.05f, 0.0f, 0.0f},
        {FINGERPAD_BODY_CYLINDER, INFINITY, 0.0f, 0.0f},
        {FINGERPAD_BODY_CYLINDER, 5.0f, 181.0f, 0.0f},
        {FINGERPAD_BODY_CYLINDER, 5.0f, NAN, 0.0f},
        {FINGERPAD_BODY_EDGE, -5.0f, 0.0f, 90.0f},
        {FINGERPAD_BODY_EDGE, 1.0f, 0.0f, 180.0f},
        {FINGERPAD_BODY_EDGE, 1.0f, 0.0f, NAN},
    };
    static const fingerpad_body taken[] = {
        {FINGERPAD_BODY_PLANE, NAN, NAN, NAN},          {FINGERPAD_BODY_SPHERE, -60.0f, NAN, NAN},
        {FINGERPAD_BODY_CYLINDER, 4.0f, -180.0f, NAN}, {FINGERPAD_BODY_EDGE, 2.0f, 30.0f, 90.0f},
    };
    fingerpad_pad_state state, before;
    fingerpad_patch patches[FINGERPAD_PATCHES_MAX];
    fingerpad_response r;
    size_t i;
    must(fingerpad_pad_state_init(pad, &state), "state of the pad");
    before = state;
    for (i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        expect(fingerpad_pad_step(pad, &state, refused[i], rolled, &r), FINGERPAD_RANGE, "a body that cannot be");
        expect(fingerpad_pad_patches(pad, &state, refused[i], patches, 64), FINGERPAD_RANGE, "patches on such a body");
    }
    expect_true(memcmp(&before, &state, sizeof state) == 0, "a refused body leaves the state");
    for (i = 0; i < sizeof taken / sizeof taken[0]; i++) {
        must(fingerpad_pad_state_init_over(pad, &state, 40.0f, 5.0f), "state of the pad");
        must(fingerpad_pad_step(pad, &state, taken[i], rolled, &r), "a body that can be");
        expect_true(r.normal_force_n > 0.01f && r.status == 0, "the finger touches it");
    }
}

static void pad_numbers(fingerpad_pad *pad)
{
    fingerpad_pad_state state, fresh;
    fingerpad_response r, larger;
    fingerpad_pad_motion motion = rolled;
    float place_mm[3], other_mm[3];
    must(fingerpad_pad_state_init(pad, &state), "state of the pad");
    motion.pitch_deg = 5.0f;
    must(fingerpad_pad_step(pad, &state, plane, motion, &r), "step of the pad");
    expect_true((r.status & FINGERPAD_STATUS_POSE_OUT_OF_RANGE) != 0, "a pitch of 5 degrees is flagged");
    motion.pitch_deg = NAN;
    must(fingerpad_pad_step(pad, &state, plane, motion, &r), "step of the pad");
    expect_true((r.status & FINGERPAD_STATUS_BAD_INPUT) != 0, "a pitch of NaN is flagged");
    fresh = state;
    expect(fingerpad_pad_state_set_strength_factor(&state, NAN), FINGERPAD_RANGE, "a strength factor of NaN");
    expect(fingerpad_pad_state_set_strength_factor(&state, 6.0f), FINGERPAD_RANGE, "a strength factor of 6");
    expect(fingerpad_pad_state_init_over(pad, &state, NAN, 0.0f), FINGERPAD_RANGE, "a state over a pitch of NaN");
    expect_true(memcmp(&fresh, &state, sizeof state) == 0, "what is refused leaves the state");
    expect(fingerpad_pad_tune(pad, NAN, 1.0f, 1.0f), FINGERPAD_RANGE, "a size of NaN");
    expect(fingerpad_pad_tune(pad, 1.0f, 6.0f, 1.0f), FINGERPAD_RANGE, "a stiffness of 6");
    expect(fingerpad_pad_first_touch(pad, 30.0f, INFINITY, place_mm), FINGERPAD_RANGE, "a roll of infinity");
    must(fingerpad_pad_first_touch(pad, 30.0f, 0.0f, place_mm), "first touch");
    expect_true(fabsf(place_mm[0]) + fabsf(place_mm[1]) + fabsf(place_mm[2]) < 0.2f, "the origin touches in the neutral pose");
    must(fingerpad_pad_first_touch(pad, 60.0f, 10.0f, place_mm), "first touch");
    expect_true(place_mm[0] > 2.0f && place_mm[1] != 0.0f && place_mm[2] > 0.2f, "a steep finger touches nearer to its tip");
    must(fingerpad_pad_state_init(pad, &state), "state of the pad");
    must(fingerpad_pad_step(pad, &state, plane, rolled, &r), "step of the pad");
    must(fingerpad_pad_tune(pad, 2.0f, 1.0f, 1.0f), "tune");
    must(fingerpad_pad_first_touch(pad, 60.0f, 10.0f, other_mm), "first touch");
    expect_true(fabsf(other_mm[0] - 2.0f * place_mm[0]) < 1e-4f, "places scale with the size");
    must(fingerpad_pad_state_init(pad, &state), "state of the pad");
    motion = rolled;
    motion.depth_mm *= 2.0f;
    must(fingerpad_pad_step(pad, &state, plane, motion, &larger), "step of the pad");
    expect_true(fabsf(larger.normal_force_n / r.normal_force_n - 4.0f) < 1e-3f, "forces with its square");
    must(fingerpad_pad_tune(pad, 1.0f, 1.0f, 1.0f), "tune");
}

static void pad_requests(const fingerpad_pad *pad)
{
    static fingerpad_pad_state state, zeroed;
    const fingerpad_body ball = {FINGERPAD_BODY_SPHERE, 10.0f, 0.0f, 0.0f}, none = {FINGERPAD_BODY_SPHERE, 0.0f, 0.0f, 0.0f};
    fingerpad_drive drive = {1, 1, 0.0f, 0.4f, 0.0f, 0.0f, 0.05f, 0.0f, 0.0f, 1e-3f};
    fingerpad_response r;
    fingerpad_motion led;
    fingerpad_gradient g;
    fingerpad_grip grip;
    must(fingerpad_pad_state_init_over(pad, &state, 30.0f, 0.0f), "a state over a ball");
    expect(fingerpad_pad_step_driven(pad, &zeroed, ball, 30.0f, 0.0f, drive, &r, &led), FINGERPAD_NOT_SET_UP, "a zeroed state, driven");
    expect(fingerpad_pad_step_driven(pad, &state, none, 30.0f, 0.0f, drive, &r, &led), FINGERPAD_RANGE, "a ball without size, driven");
    must(fingerpad_pad_step_driven(pad, &state, ball, 30.0f, 0.0f, drive, &r, NULL), "a driven step");
    must(fingerpad_pad_step_driven(pad, &state, ball, 30.0f, 0.0f, drive, &r, &led), "a driven step again");
    expect_true(r.status == 0 && fabsf(r.normal_force_n - 0.4f) < 1e-3f && fabsf(r.friction_x_n - 0.05f) < 1e-3f, "a load on a pad");
    expect_true(led.slide_x_mm == 0.0f && led.depth_mm > 0.1f, "a load that is there does not creep");
    must(fingerpad_pad_gradient(pad, &state, ball, 0.0f, 0.0f, 0.0f, &g), "a gradient of a pad");
    expect_true(g.normal_n_mm[0] > 0.1f && g.friction_x_n_mm[1] > 0.05f && g.friction_y_n_mm[2] > 0.05f, "stiffness of a pad");
    expect(fingerpad_pad_gradient(pad, &state, ball, 0.0f, 0.0f, 0.0f, NULL), FINGERPAD_NULL, "no gradient");
    must(fingerpad_pad_least_grip(pad, ball, 30.0f, 0.0f, 0.1f, 0.0f, 0.2f, 1.0f, &grip), "the least grip of a pad");
    expect_true(grip.status == 0 && grip.depth_mm > 0.1f && grip.normal_force_n > 0.02f, "a grip of a pad");
    must(fingerpad_pad_least_grip(pad, ball, 30.0f, 0.0f, 90.0f, 0.0f, 0.2f, 1.0f, &grip), "a load without a grip");
    expect_true((grip.status & FINGERPAD_STATUS_LOAD_NOT_REACHED) != 0, "no grip holds it");
}

/* The patches of a pad add up to its response. */
static void skin(const fingerpad_pad *pad, const fingerpad_frame_contact *contact, const fingerpad_frame_response *r)
{
    static fingerpad_frame_patch patches[FINGERPAD_PATCHES_MAX];
    fingerpad_pad_info info;
    float force[3] = {0.0f, 0.0f, 0.0f}, moment[3] = {0.0f, 0.0f, 0.0f};
    must(fingerpad_pad_describe(pad, &info), "a pad");
    must(fingerpad_frame_patches(pad, contact, patches, info.patches), "patches in frames");
    for (unsigned i = 0; i < info.patches; i++) {
        for (int k = 0; k < 3; k++) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            const float *at = patches[i].place_mm, *own = patches[i].force_n;
            force[k] += own[k];
            moment[k] += patches[i].moment_n_mm[k] + at[a] * own[b] - at[b] * own[a];
        }
    }
    for (int k = 0; k < 3; k++) {
        expect_true(fabsf(force[k] - r->on_finger.force_n[k]) < 1e-4f, "the force of the patches");
        expect_true(fabsf(moment[k] - r->on_finger.moment_n_mm[k]) < 1e-3f, "the moment of the patches");
    }
}

static void frame_handles(const fingerpad_pad *pad, const fingerpad_model *model)
{
    static fingerpad_frame_contact zeroed, contact;
    fingerpad_shape shape = {FINGERPAD_SHAPE_SPHERE, {10.0, 0.0, 0.0}, 0.0, 0.0};
    /* A ball below the finger in its neutral pose. */
    const fingerpad_pose below = {{4.6, 0.0, -7.97}, {0.9659258262890683, 0.0, -0.25881904510252074, 0.0}};
    const fingerpad_pose none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}};
    static fingerpad_frame_patch patches[FINGERPAD_PATCHES_MAX];
    fingerpad_frame_response r;
    expect(fingerpad_frame_step_pad(pad, &zeroed, &below, 1e-3f, &r), FINGERPAD_NOT_SET_UP, "a zeroed contact in frames");
    expect(fingerpad_frame_init_bed(model, shape, &contact), FINGERPAD_RANGE, "a bed on a ball");
    must(fingerpad_frame_init_pad(pad, shape, &contact), "a contact in frames");
    expect(fingerpad_frame_step_bed(model, &contact, &below, 1e-3f, &r), FINGERPAD_NOT_SET_UP, "a step of a bed for a pad's contact");
    expect(fingerpad_frame_step_pad(pad, NULL, &below, 1e-3f, &r), FINGERPAD_NULL, "no contact in frames");
    expect(fingerpad_frame_step_pad(pad, &contact, NULL, 1e-3f, &r), FINGERPAD_NULL, "no pose");
    expect(fingerpad_frame_step_pad(pad, &contact, &below, 1e-3f, NULL), FINGERPAD_NULL, "no response in frames");
    must(fingerpad_frame_step_pad(pad, &contact, &below, 1e-3f, &r), "step in frames");
    expect_true(r.face == 1 && r.response.status == 0 && r.depth_mm > 0.5f, "a ball below the finger");
    must(fingerpad_frame_step_pad(pad, &contact, &none, 1e-3f, &r), "step to no pose");
    expect_true(r.response.status == FINGERPAD_STATUS_BAD_INPUT && r.depth_mm > 0.5f, "a quaternion of length 0 is not taken");
    skin(pad, &contact, &r);
    expect(fingerpad_frame_patches(pad, &zeroed, patches, FINGERPAD_PATCHES_MAX), FINGERPAD_NOT_SET_UP, "patches of a zeroed contact");
    expect(fingerpad_frame_patches(pad, NULL, patches, FINGERPAD_PATCHES_MAX), FINGERPAD_NULL, "patches of no contact");
    expect(fingerpad_frame_patches(pad, &contact, NULL, FINGERPAD_PATCHES_MAX), FINGERPAD_NULL, "no patches in frames");
    expect(fingerpad_frame_patches(pad, &contact, patches, 1), FINGERPAD_BUFFER, "too few patches in frames");
    expect(fingerpad_frame_set_strength_factor(&contact, 9.0f), FINGERPAD_RANGE, "a strength factor in frames");
    expect(fingerpad_frame_set_strength_factor(&zeroed, 1.0f), FINGERPAD_NOT_SET_UP, "strength of a zeroed contact in frames");
    expect(fingerpad_frame_reshape(&contact, shape, NULL), FINGERPAD_NULL, "no pose of a new shape");
    must(fingerpad_frame_reshape(&contact, shape, &below), "a new shape");
    must(fingerpad_frame_step_pad(pad, &contact, &below, 1e-3f, &r), "step on a new shape");
    expect(fingerpad_frame_set_bed_radius(&contact, 21.0f, 21.0f), FINGERPAD_NOT_SET_UP, "the radius of a pad");
    expect_true(fingerpad_frame_bytes(&contact) > 1000 && fingerpad_frame_bytes(&contact) < sizeof(contact), "bytes of a contact");
    expect_true(fingerpad_frame_bytes(&zeroed) == 0, "bytes of a zeroed contact");
    /* All but the mark. */
    memset((char *)&contact + 4, 0xff, sizeof(contact) - 4);
    must(fingerpad_frame_patches(pad, &contact, patches, FINGERPAD_PATCHES_MAX), "patches of an overwritten contact");
    expect_true(patches[0].area_mm2 > 0.0f && patches[0].pressure_mpa == 0.0f, "an overwritten contact has no load");
    must(fingerpad_frame_step_pad(pad, &contact, &below, 1e-3f, &r), "step of an overwritten contact");
    expect_true((r.response.status & FINGERPAD_STATUS_MEMORY_LOST) && r.on_finger.force_n[2] == 0.0f, "an overwritten contact is flagged");
    shape.kind = FINGERPAD_SHAPE_BOX;
    expect(fingerpad_frame_init_pad(pad, shape, &contact), FINGERPAD_RANGE, "a box without extents");
    shape.size_mm[1] = shape.size_mm[2] = 10.0;
    shape.edge_radius_mm = 1.0;
    must(fingerpad_frame_init_bed(model, shape, &contact), "a bed on a box");
    must(fingerpad_frame_step_bed(model, &contact, &below, 1e-3f, &r), "step of a bed in frames");
    expect(fingerpad_frame_patches(pad, &contact, patches, FINGERPAD_PATCHES_MAX), FINGERPAD_NOT_SET_UP, "patches of a bed in frames");
    expect(fingerpad_frame_set_bed_radius(&contact, -1.0f, 21.0f), FINGERPAD_RANGE, "a radius below 0");
    must(fingerpad_frame_set_bed_radius(&contact, 0.0f, 1000.0f), "a radius of a bed");
    shape.kind = FINGERPAD_SHAPE_SPHERE;
    expect(fingerpad_frame_reshape(&contact, shape, &below), FINGERPAD_RANGE, "a bed on a ball that was a box");
}

/* Tissue that relaxes: a hold, steps of no time, and states without room for its memory. */
static void relaxing_pads(fingerpad_pad pad, const model_file *file)
{
    static const fingerpad_branch branches[4] = {{1.0f, 0.004f}, {0.6f, 0.07f}, {0.6f, 1.4f}, {0.1f, 1.0f}};
    static const fingerpad_branch wrong[3] = {{-0.1f, 1.0f}, {0.5f, NAN}, {0.5f, 0.0f}};
    static const float no_times[4] = {0.0f, -1.0f, NAN, INFINITY};
    static uint8_t bytes[FINGERPAD_RELAXING_PAD_STATE_BYTES];
    const fingerpad_shape flat = {FINGERPAD_SHAPE_PLANE, {0.0, 0.0, 0.0}, 0.0, 0.0};
    /* A plane that has come up by 1 mm along its normal in the neutral pose. */
    const fingerpad_pose up = {{-0.5, 0.0, 0.8660254037844386}, {0.9659258262890683, 0.0, -0.25881904510252074, 0.0}};
    fingerpad_pad_motion motion = {1.0f, 0.0f, 0.0f, 0.0f, 30.0f, 0.0f, 1e-7f};
    fingerpad_pad_state plain;
    static fingerpad_relaxing_pad_state state, zeroed;
    static fingerpad_relaxing_frame_contact framed;
    fingerpad_frame_response felt;
    fingerpad_pad prompt;
    fingerpad_pad_info info;
    fingerpad_response first, r;
    fingerpad_gradient g;
    static fingerpad_patch patches[FINGERPAD_PATCHES_MAX];
    float time_s = 0.0f, felt_first;
    int i;
    for (i = 0; i < 3; i++) {
        expect(fingerpad_pad_relax(&pad, &wrong[i], 1), FINGERPAD_RANGE, "a branch out of range");
    }
    expect(fingerpad_pad_relax(&pad, branches, 4), FINGERPAD_SHAPE, "four branches");
    expect(fingerpad_pad_relax(&pad, NULL, 1), FINGERPAD_NULL, "no branches");
    must(fingerpad_pad_state_init(&pad, &plain), "a state before the branches");
    must(fingerpad_pad_relax(&pad, branches, 3), "branches");
    must(fingerpad_pad_describe(&pad, &info), "info of a pad that relaxes");
    expect_true(info.branches == 3 && info.state_bytes == 2864, "branches and bytes of a state");
    expect(fingerpad_pad_state_init(&pad, &plain), FINGERPAD_BUFFER, "a state without room for the memory");
    expect(fingerpad_pad_step(&pad, &plain, plane, motion, &r), FINGERPAD_NOT_SET_UP, "a state that does not relax");
    must(fingerpad_relaxing_pad_state_init(&pad, &state), "a state that relaxes");
    must(fingerpad_pad_step(&pad, &state.state, plane, motion, &first), "press");
    for (i = 0; i < 4; i++) {
        motion.dt_s = no_times[i];
        must(fingerpad_pad_step(&pad, &state.state, plane, motion, &r), "a step of no time");
        expect_true(r.status == FINGERPAD_STATUS_BAD_TIME_STEP && fabsf(r.normal_force_n / first.normal_force_n - 1.0f) < 1e-3f,
                    "a step of no time is flagged and freezes the memory");
    }
    must(fingerpad_pad_state_save(&pad, &state.state, bytes, sizeof bytes), "save");
    expect(fingerpad_pad_state_restore(&pad, &plain, bytes, info.state_bytes), FINGERPAD_NOT_SET_UP, "no room to restore");
    expect(fingerpad_pad_state_restore(&pad, &zeroed.state, bytes, info.state_bytes), FINGERPAD_NOT_SET_UP, "a zeroed state to restore");
    for (i = 0; i < 1500; i++) {
        const float dt_s = i < 500 ? 1e-4f : 1e-3f * powf(1.01f, (float)(i - 500));
        float over;
        time_s += dt_s;
        motion.dt_s = dt_s;
        must(fingerpad_pad_step(&pad, &state.state, plane, motion, &r), "hold");
        over = 1.0f + expf(-time_s / 0.004f) + 0.6f * expf(-time_s / 0.07f) + 0.6f * expf(-time_s / 1.4f);
        expect_true(fabsf(r.normal_force_n / first.normal_force_n * 3.2f / over - 1.0f) < 4e-3f, "the force of a hold falls as its branches do");
    }
    expect_true(first.friction_limit_n > 1.8f * r.friction_limit_n && fabsf(r.slip_margin_relaxed - r.slip_margin) < 1e-5f,
                "the limit falls, and then nothing more is lost");
    expect_true(first.slip_margin > first.slip_margin_relaxed + 1e-3f
                    && fabsf((1.0f - first.slip_margin_relaxed) * r.friction_limit_n / ((1.0f - first.slip_margin) * first.friction_limit_n) - 1.0f) < 3e-3f,
                "the margin that is left is told at first");
    must(fingerpad_pad_state_restore(&pad, &state.state, bytes, info.state_bytes), "restore");
    motion.dt_s = 1e-7f;
    must(fingerpad_pad_step(&pad, &state.state, plane, motion, &r), "as at first");
    expect_true(fabsf(r.normal_force_n / first.normal_force_n - 1.0f) < 1e-3f, "a restored state remembers");
    expect(fingerpad_frame_init_pad(&pad, flat, &framed.contact), FINGERPAD_BUFFER, "a contact in frames without room for the memory");
    expect_true(fingerpad_frame_bytes(&framed.contact) == 0, "a refused contact in frames");
    must(fingerpad_relaxing_frame_init_pad(&pad, flat, &framed), "frames");
    must(fingerpad_frame_step_pad(&pad, &framed.contact, &up, 1e-4f, &felt), "press in frames");
    must(fingerpad_frame_step_pad(&pad, &framed.contact, &up, 1e-4f, &felt), "press in frames");
    felt_first = felt.response.normal_force_n;
    must(fingerpad_frame_step_pad(&pad, &framed.contact, &up, 100.0f, &felt), "hold in frames");
    expect_true(fingerpad_frame_bytes(&framed.contact) > 2864 && felt_first > 2.0f * felt.response.normal_force_n
                    && felt.response.normal_force_n > 0.0f, "a hold in frames");
    /* The same tissue, loaded by a program that does not ask for its steps. */
    must(fingerpad_pad_load(&prompt, bytes_of(file), file->length), RELAXING_NAME);
    must(fingerpad_pad_describe(&prompt, &info), "info of such a pad");
    expect_true(info.branches == 3 && info.state_bytes == 2864, "branches of such a pad");
    expect(fingerpad_pad_state_init(&prompt, &plain), FINGERPAD_BUFFER, "a state of such a pad");
    expect(fingerpad_relaxing_pad_state_init(&prompt, &zeroed), FINGERPAD_NOT_SET_UP, "a state that relaxes of such a pad");
    expect(fingerpad_relaxing_pad_state_init_over(&prompt, &zeroed, 30.0f, 0.0f), FINGERPAD_NOT_SET_UP, "the same over a body");
    expect(fingerpad_relaxing_frame_init_pad(&prompt, flat, &framed), FINGERPAD_NOT_SET_UP, "a contact in frames of such a pad");
    expect(fingerpad_pad_step(&prompt, &state.state, plane, motion, &r), FINGERPAD_NOT_SET_UP, "a step of such a pad");
    expect(fingerpad_pad_gradient(&prompt, &state.state, plane, 0.0f, 0.0f, 0.0f, &g), FINGERPAD_NOT_SET_UP, "its gradient");
    expect(fingerpad_pad_patches(&prompt, &state.state, plane, patches, FINGERPAD_PATCHES_MAX), FINGERPAD_NOT_SET_UP, "its patches");
    expect(fingerpad_frame_step_pad(&prompt, &framed.contact, &up, 1e-3f, &felt), FINGERPAD_NOT_SET_UP, "its step in frames");
    must(fingerpad_relaxing_pad_load(&prompt, bytes_of(file), file->length), RELAXING_NAME);
    must(fingerpad_pad_step(&prompt, &state.state, plane, motion, &r), "a step of a pad that was loaded to relax");
    must(fingerpad_pad_gradient(&prompt, &state.state, plane, 0.0f, 0.0f, 0.0f, &g), "its gradient");
    must(fingerpad_pad_patches(&prompt, &state.state, plane, patches, FINGERPAD_PATCHES_MAX), "its patches");
    must(fingerpad_frame_step_pad(&prompt, &framed.contact, &up, 1e-3f, &felt), "its step in frames");
    must(fingerpad_pad_relax(&pad, NULL, 0), "no branches any more");
    expect(fingerpad_pad_step(&pad, &state.state, plane, motion, &r), FINGERPAD_NOT_SET_UP, "a state that relaxes, of a pad that does not");
    must(fingerpad_relaxing_pad_state_init(&pad, &state), "more room than it needs");
    must(fingerpad_pad_step(&pad, &state.state, plane, motion, &r), "press");
    expect_true(fabsf(3.2f * r.normal_force_n / first.normal_force_n - 1.0f) < 1e-2f, "the relaxed tissue");
}

/* The same of a bed. */
static void relaxing_beds(fingerpad_model model, fingerpad_model charged, const model_file *file)
{
    static const fingerpad_branch branches[4] = {{1.0f, 0.004f}, {0.6f, 0.07f}, {0.6f, 1.4f}, {0.1f, 1.0f}};
    static const fingerpad_branch wrong[4] = {{-0.1f, 1.0f}, {0.5f, NAN}, {0.5f, 0.0f}, {50.0f, 1.0f}};
    static const float no_times[4] = {0.0f, -1.0f, NAN, INFINITY};
    const fingerpad_shape flat = {FINGERPAD_SHAPE_PLANE, {0.0, 0.0, 0.0}, 0.0, 0.0};
    const fingerpad_shape ball = {FINGERPAD_SHAPE_SPHERE, {10.0, 0.0, 0.0}, 0.0, 0.0};
    /* A plane that has come up by 1 mm along its normal in the neutral pose. */
    const fingerpad_pose up = {{-0.5, 0.0, 0.8660254037844386}, {0.9659258262890683, 0.0, -0.25881904510252074, 0.0}};
    uint8_t bytes[FINGERPAD_RELAXING_STATE_BYTES];
    fingerpad_motion motion = {1.0f, 0.0f, 0.0f, 0.0f, 1e-7f};
    fingerpad_model loaded;
    fingerpad_model_info info;
    fingerpad_state plain;
    fingerpad_force_state force_state;
    fingerpad_force_response forces;
    fingerpad_contact contact;
    static fingerpad_frame_contact framed;
    fingerpad_frame_response pressed, held;
    fingerpad_relaxing_state state, zeroed;
    fingerpad_response first, r;
    float time_s = 0.0f;
    int i;
    for (i = 0; i < 4; i++) {
        expect(fingerpad_model_relax(&model, &wrong[i], 1), FINGERPAD_RANGE, "a branch of a bed out of range");
    }
    expect(fingerpad_model_relax(&model, branches, 4), FINGERPAD_SHAPE, "four branches of a bed");
    expect(fingerpad_model_relax(&model, NULL, 1), FINGERPAD_NULL, "no branches of a bed");
    expect(fingerpad_model_relax(&charged, branches, 3), FINGERPAD_SECTION, "branches beside the effect normal_relaxation");
    must(fingerpad_model_relax(&model, branches, 3), "branches of a bed");
    must(fingerpad_model_describe(&model, &info), "info of a bed that relaxes");
    expect_true(info.branches == 3, "branches of a bed");
    must(fingerpad_state_init(&plain), "a state that does not relax");
    must(fingerpad_force_state_init(&force_state), "forces that do not relax");
    must(fingerpad_contact_init(&contact), "a contact that does not relax");
    expect(fingerpad_step(&model, &plain, motion, &r), FINGERPAD_NOT_SET_UP, "a step of a bed that relaxes");
    expect(fingerpad_step_forces(&model, &force_state, motion, &forces), FINGERPAD_NOT_SET_UP, "its forces");
    expect(fingerpad_frame_init_bed(&model, ball, &framed), FINGERPAD_RANGE, "its ball");
    expect_true(fingerpad_frame_bytes(&framed) == 0, "a refused contact of a bed in frames");
    must(fingerpad_frame_init_bed(&model, flat, &framed), "its frames");
    must(fingerpad_frame_set_bed_radius(&framed, 0.0f, 1000.0f), "its radius");
    expect(fingerpad_frame_reshape(&framed, ball, &up), FINGERPAD_RANGE, "its new shape");
    must(fingerpad_frame_step_bed(&model, &framed, &up, 1e-7f, &pressed), "press in frames");
    must(fingerpad_frame_step_bed(&model, &framed, &up, 100.0f, &held), "hold in frames");
    expect_true(fabsf(pressed.response.normal_force_n / held.response.normal_force_n - 3.2f) < 1e-3f, "a hold of a bed in frames");
    expect_true(fingerpad_frame_bytes(&framed) > sizeof(fingerpad_relaxing_spin_state), "bytes of such a contact");
    (void)memset(&zeroed, 0, sizeof zeroed);
    expect(fingerpad_relaxing_step(&model, &zeroed, motion, &r), FINGERPAD_NOT_SET_UP, "a zeroed state that relaxes");
    must(fingerpad_relaxing_state_init(&state), "a state that relaxes");
    must(fingerpad_relaxing_step(&model, &state, motion, &first), "press");
    for (i = 0; i < 4; i++) {
        motion.dt_s = no_times[i];
        must(fingerpad_relaxing_step(&model, &state, motion, &r), "a step of no time");
        expect_true(r.status == FINGERPAD_STATUS_BAD_TIME_STEP && fabsf(r.normal_force_n / first.normal_force_n - 1.0f) < 1e-6f,
                    "a step of no time is flagged and freezes the memory of a bed");
    }
    expect(fingerpad_relaxing_state_save(&model, &state, bytes, sizeof bytes - 1), FINGERPAD_BUFFER, "a short buffer");
    must(fingerpad_relaxing_state_save(&model, &state, bytes, sizeof bytes), "save");
    for (i = 0; i < 1000; i++) {
        float over;
        motion.dt_s = i < 500 ? 1e-4f : 1e-3f * powf(1.01f, (float)(i - 500));
        time_s += motion.dt_s;
        must(fingerpad_relaxing_step(&model, &state, motion, &r), "hold");
        over = 1.0f + expf(-time_s / 0.004f) + 0.6f * expf(-time_s / 0.07f) + 0.6f * expf(-time_s / 1.4f);
        expect_true(fabsf(r.normal_force_n / first.normal_force_n * 3.2f / over - 1.0f) < 1e-4f, "the force of a bed falls as its branches do");
    }
    bytes[20] ^= 1;
    expect(fingerpad_relaxing_state_restore(&model, &state, bytes, sizeof bytes), FINGERPAD_CHECKSUM, "damage");
    bytes[20] ^= 1;
    must(fingerpad_relaxing_state_restore(&model, &zeroed, bytes, sizeof bytes), "restore");
    motion.dt_s = 1e-7f;
    must(fingerpad_relaxing_step(&model, &zeroed, motion, &r), "as at first");
    expect_true(fabsf(r.normal_force_n / first.normal_force_n - 1.0f) < 1e-4f, "a restored state of a bed remembers");
    must(fingerpad_model_relax(&model, NULL, 0), "no branches any more");
    must(fingerpad_step(&model, &plain, motion, &r), "a step of a bed that does not relax");
    expect(fingerpad_frame_step_bed(&model, &framed, &up, 1e-3f, &held), FINGERPAD_NOT_SET_UP, "a contact in frames of other branches");
    expect(fingerpad_relaxing_state_restore(&model, &state, bytes, sizeof bytes), FINGERPAD_OTHER_MODEL, "a state of other branches");
    expect(fingerpad_model_load(&loaded, bytes_of(file), file->length), FINGERPAD_SECTION, RELAXING_BED_NAME);
    must(fingerpad_relaxing_model_load(&loaded, bytes_of(file), file->length), RELAXING_BED_NAME);
    must(fingerpad_relaxing_state_restore(&loaded, &state, bytes, sizeof bytes), "the branches of the file");
}

static void pads(const model_file *bed, const model_file *file, const model_file *halved, const model_file *relaxing)
{
    fingerpad_pad pad, many;
    pad_files(bed, file);
    must(fingerpad_pad_load(&pad, bytes_of(file), file->length), PAD_NAME);
    must(fingerpad_pad_load(&many, bytes_of(halved), halved->length), HALVED_NAME);
    pads_of_other_sizes(&pad, &many);
    pad_handles(&pad);
    pad_buffers(&pad);
    pad_bodies(&pad);
    pad_numbers(&pad);
    {
        fingerpad_model model;
        must(fingerpad_model_load(&model, bytes_of(bed), bed->length), "bed");
        frame_handles(&pad, &model);
        pad_requests(&pad);
    }
    relaxing_pads(pad, relaxing);
}

int main(int argc, char **argv)
{
    static model_file file, more, pad, halved, relaxing, relaxing_bed;
    fingerpad_model model, charged;
    if (argc != 3) {
        return 2;
    }
    read_file(&file, argv[1]);
    read_file(&more, argv[2]);
    must(fingerpad_model_load(&charged, bytes_of(&more), more.length), argv[2]);
    files(&file);
    handles(&file);
    must(fingerpad_model_load(&model, bytes_of(&file), file.length), argv[1]);
    own_columns(&model, &charged);
    misaligned(&model);
    buffers(&model);
    batches(&model);
    observers(&model);
    numbers(&model);
    read_pad(&pad, PAD_NAME, argv[2]);
    read_pad(&halved, HALVED_NAME, argv[2]);
    read_pad(&relaxing, RELAXING_NAME, argv[2]);
    pads(&file, &pad, &halved, &relaxing);
    read_pad(&relaxing_bed, RELAXING_BED_NAME, argv[2]);
    relaxing_beds(model, charged, &relaxing_bed);
    (void)printf("%d failures\n", failures);
    return failures != 0;
}
