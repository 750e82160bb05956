/* What a caller gets wrong is answered by a code, and changes nothing: misuse MODEL.fpm CHARGED.fpm
 * CHARGED.fpm is the story's model with tables over a voltage. */
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
    (void)memset(&contact, 0, sizeof contact);
    (void)memset(&watch, 0, sizeof watch);
    must(fingerpad_surroundings_default(&around), "surroundings");
    must(fingerpad_model_load(&model, bytes_of(file), file->length), "model");
    expect(fingerpad_step(&model, &state, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed state");
    expect(fingerpad_spin_step(&model, &spin, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed spin state");
    expect(fingerpad_contact_step(&model, &contact, around, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed contact");
    must(fingerpad_state_init(&state), "state");
    must(fingerpad_step(&model, &state, pressed, &r), "step");
    expect(fingerpad_watch_look(&watch, &r, events, &count), FINGERPAD_NOT_SET_UP, "a zeroed watch");
    expect(fingerpad_step(&zeroed, &state, pressed, &r), FINGERPAD_NOT_SET_UP, "a zeroed model");
    expect(fingerpad_model_describe(&zeroed, &info), FINGERPAD_NOT_SET_UP, "a zeroed model described");
    expect(fingerpad_model_tune(&zeroed, 1.0f, 1.0f, 1.0f, 0.0f), FINGERPAD_NOT_SET_UP, "a zeroed model tuned");
    expect(fingerpad_model_pose(&zeroed, 30.0f, 0.0f), FINGERPAD_NOT_SET_UP, "a zeroed model posed");
    before = state;
    expect(fingerpad_step(&model, NULL, pressed, &r), FINGERPAD_NULL, "no state");
    expect(fingerpad_step(NULL, &state, pressed, &r), FINGERPAD_NULL, "no model");
    expect(fingerpad_step(&model, &state, pressed, NULL), FINGERPAD_NULL, "no response");
    expect_true(memcmp(&before, &state, sizeof state) == 0, "a refused step leaves the state");
    must(fingerpad_model_describe(&model, &info), "info");
    expect_true(info.meta_length > 0 && info.meta[0] == '{', "the description is JSON");
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
    expect(fingerpad_model_tune(model, NAN, 1.0f, 1.0f, 0.0f), FINGERPAD_RANGE, "a size of NaN");
    expect(fingerpad_model_pose(model, 5.0f, 0.0f), FINGERPAD_RANGE, "a pitch of 5 degrees");
    must(fingerpad_watch_settings_default(&settings), "settings");
    must(fingerpad_watch_init(&watch, 0, settings), "watch");
    r.regime = 77;
    expect(fingerpad_watch_look(&watch, &r, events, &count), FINGERPAD_RANGE, "a regime that is none");
    settings.restick = NAN;
    expect(fingerpad_watch_init(&watch, 0, settings), FINGERPAD_RANGE, "a threshold of NaN");
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

int main(int argc, char **argv)
{
    static model_file file, more;
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
    numbers(&model);
    (void)printf("%d failures\n", failures);
    return failures != 0;
}
