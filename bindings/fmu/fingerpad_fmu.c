/* The reduced model as an FMI 3.0 co-simulation unit, on the C library.
 *
 * Slides and the angle come as places (mm, rad) and are differenced in 64 bits: what the 32 bits of an increment leave out is
 * made up in the next step, so that nothing drifts. The input at a step's start holds over the step, as FMI has it: the plane moves
 * there in a straight line, in equal substeps of at most SUBSTEP_MM.
 * Functions that this unit has no use for are in unused.c. */
#include "fmi3Functions.h"
#include <fingerpad.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Value references, as modelDescription.xml has them. */
enum {
    TIME = 0,
    DEPTH_MM = 1, SLIDE_X_MM, SLIDE_Y_MM, SPIN_RAD, STRENGTH_FACTOR,
    HYDRATION_AU = 8, TEMPERATURE_C, FINGER_WIDTH_MM, SERIES_S,
    OWN = 12, INPUTS_END = 16, /* columns of the user's own */
    SIZE = 21, STIFFNESS, LAMBDA, PARAMETERS_END,
    NORMAL_FORCE_N = 41, FRICTION_X_N, FRICTION_Y_N, SPIN_MOMENT_N_MM, STICK_RATIO, FRICTION_LIMIT_N, SLIP_MARGIN,
    PRESSURE_CENTRE_X_MM, PRESSURE_CENTRE_Y_MM, CONTACT_AREA_MM2, BAND_NORMAL_N, BAND_FRICTION_N, OUTPUTS_END,
    REGIME = 61, STATUS, SUBSTEPS
};

/* A communication step is divided so that the changes of depth, slide x, slide y and of the angle times ARM_MM sum to at most
 * SUBSTEP_MM in each substep, up to SUBSTEPS_MAX of them. */
#define SUBSTEP_MM 0.005
#define ARM_MM 4.0
#define SUBSTEPS_MAX 1000.0

/* Numbers that are refused outside a range: those of the model's tuning, and the strength factor of a step. */
typedef struct {
    int reference;
    const char *name;
    float least, most;
} limits;

static const limits TUNING[] = {
    {SIZE, "size", 0.5f, 2.0f},
    {STIFFNESS, "stiffness", 0.2f, 5.0f},
    {LAMBDA, "lambda", 0.1f, 10.0f},
};
static const limits STRENGTH = {STRENGTH_FACTOR, "strength_factor", 0.1f, 5.0f};

/* All that a step changes and all that it reads: what fmi3GetFMUState keeps. */
typedef struct {
    double number[OUTPUTS_END]; /* by value reference */
    int32_t regime, status, substeps;
    double followed[4]; /* depth, slide x, slide y and angle to which the contact was brought */
    fingerpad_spin_state state;
    fingerpad_contact contact; /* in place of the state where the file has effects */
} memory;

/* The written form of a state: its kind, its model, and a check of its completeness. */
typedef struct {
    uint32_t magic, version, model, checksum;
    memory inside;
} serialized;

enum { MAGIC = 0x46504d55, VERSION = 2 };

typedef enum { INSTANTIATED, INITIALIZATION, STEPPING, TERMINATED } phase;

typedef struct {
    phase phase;
    memory now;
    /* The model as it is used, and its file. */
    fingerpad_model model;
    fingerpad_model_info info;
    uint64_t *file;
    size_t length;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    int logging;
} unit;

static fmi3Status say(const unit *u, fmi3Status status, const char *format, ...)
{
    char text[256];
    va_list more;
    if (u->log != NULL && (u->logging || status >= fmi3Error)) {
        va_start(more, format);
        (void)vsnprintf(text, sizeof text, format, more);
        va_end(more);
        u->log(u->environment, status, status >= fmi3Error ? "logStatusError" : "logStatusWarning", text);
    }
    return status;
}

/* ---- Life ---- */

static int read_model(unit *u, const char *resources)
{
    char path[4096];
    FILE *from;
    long length;
    int32_t code;
    const char *const slash = resources[0] != 0 && resources[strlen(resources) - 1] == '/' ? "" : "/";
    if (snprintf(path, sizeof path, "%s%smodel.fpm", resources, slash) >= (int)sizeof path) {
        (void)say(u, fmi3Error, "the path of the resources is too long");
        return 0;
    }
    from = fopen(path, "rb");
    if (from == NULL || fseek(from, 0, SEEK_END) != 0 || (length = ftell(from)) < 0 || fseek(from, 0, SEEK_SET) != 0) {
        (void)say(u, fmi3Error, "%s cannot be read", path);
        if (from != NULL) {
            (void)fclose(from);
        }
        return 0;
    }
    u->file = (uint64_t *)calloc((size_t)length / 8 + 1, 8);
    if (u->file == NULL || fread(u->file, 1, (size_t)length, from) != (size_t)length) {
        (void)say(u, fmi3Error, "%s cannot be read", path);
        (void)fclose(from);
        return 0;
    }
    (void)fclose(from);
    u->length = (size_t)length;
    code = fingerpad_model_load(&u->model, (const uint8_t *)u->file, u->length);
    if (code == FINGERPAD_OK) {
        code = fingerpad_model_describe(&u->model, &u->info);
    }
    if (code != FINGERPAD_OK) {
        (void)say(u, fmi3Error, "%s: %s", path, fingerpad_error_text(code));
        return 0;
    }
    return 1;
}

/* A finger in the air, all inputs at their start values. */
static void begin(unit *u)
{
    fingerpad_surroundings around;
    memory *m = &u->now;
    int k;
    (void)memset(m, 0, sizeof *m);
    m->number[STRENGTH_FACTOR] = m->number[SIZE] = m->number[STIFFNESS] = m->number[LAMBDA] = 1.0;
    m->number[SLIP_MARGIN] = 1.0;
    (void)fingerpad_model_load(&u->model, (const uint8_t *)u->file, u->length);
    (void)fingerpad_model_surroundings(&u->model, &around);
    for (k = 0; k < INPUTS_END - OWN; k++) {
        m->number[OWN + k] = (double)around.own[k];
    }
    m->number[HYDRATION_AU] = (double)around.hydration_au;
    m->number[TEMPERATURE_C] = (double)around.temperature_c;
    m->number[FINGER_WIDTH_MM] = (double)around.finger_width_mm;
    (void)fingerpad_spin_state_init(&m->state);
    (void)fingerpad_contact_init(&m->contact);
    u->phase = INSTANTIATED;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String instanceName, fmi3String instantiationToken, fmi3String resourcePath,
                                         fmi3Boolean visible, fmi3Boolean loggingOn, fmi3Boolean eventModeUsed,
                                         fmi3Boolean earlyReturnAllowed,
                                         const fmi3ValueReference requiredIntermediateVariables[],
                                         size_t nRequiredIntermediateVariables,
                                         fmi3InstanceEnvironment instanceEnvironment, fmi3LogMessageCallback logMessage,
                                         fmi3IntermediateUpdateCallback intermediateUpdate)
{
    char token[64];
    unit *u = (unit *)calloc(1, sizeof *u);
    (void)instanceName, (void)visible, (void)eventModeUsed, (void)earlyReturnAllowed;
    (void)requiredIntermediateVariables, (void)nRequiredIntermediateVariables, (void)intermediateUpdate;
    if (u == NULL) {
        return NULL;
    }
    u->environment = instanceEnvironment;
    u->log = logMessage;
    u->logging = loggingOn;
    if (resourcePath == NULL || instantiationToken == NULL) {
        (void)say(u, fmi3Error, "no path of the resources or no instantiation token");
        fmi3FreeInstance(u);
        return NULL;
    }
    if (!read_model(u, resourcePath)) {
        fmi3FreeInstance(u);
        return NULL;
    }
    (void)snprintf(token, sizeof token, "{fingerpad-%d-%08x}", VERSION, (unsigned)u->info.checksum);
    if (strcmp(token, instantiationToken) != 0) {
        (void)say(u, fmi3Error, "the instantiation token is %s, that of the model %s", instantiationToken, token);
        fmi3FreeInstance(u);
        return NULL;
    }
    begin(u);
    return u;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    if (instance != NULL) {
        free(((unit *)instance)->file);
        free(instance);
    }
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime)
{
    unit *u = (unit *)instance;
    (void)toleranceDefined, (void)tolerance, (void)stopTimeDefined, (void)stopTime;
    if (u == NULL || u->phase != INSTANTIATED) {
        return fmi3Error;
    }
    u->now.number[TIME] = startTime;
    u->phase = INITIALIZATION;
    return fmi3OK;
}

/* Whether a number is in its range; otherwise a message names it, its value and the range. */
static int in_range(const unit *u, const limits *of, fmi3Status status)
{
    const double value = u->now.number[of->reference];
    if ((float)value >= of->least && (float)value <= of->most) {
        return 1;
    }
    (void)say(u, status, "%s is %g; the allowed range is %g to %g", of->name, value, (double)of->least, (double)of->most);
    return 0;
}

static fmi3Status tune(unit *u)
{
    const double *n = u->now.number;
    int32_t code;
    size_t i;
    int refused = 0;
    for (i = 0; i < sizeof TUNING / sizeof TUNING[0]; i++) {
        refused += !in_range(u, &TUNING[i], fmi3Error);
    }
    if (refused > 0) {
        return fmi3Error;
    }
    code = fingerpad_model_tune(&u->model, (float)n[SIZE], (float)n[STIFFNESS], (float)n[LAMBDA]);
    if (code != FINGERPAD_OK) {
        return say(u, fmi3Error, "size %g, stiffness %g, lambda %g: %s", n[SIZE], n[STIFFNESS], n[LAMBDA],
                   fingerpad_error_text(code));
    }
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    unit *u = (unit *)instance;
    int k;
    if (u == NULL || u->phase != INITIALIZATION) {
        return fmi3Error;
    }
    if (tune(u) != fmi3OK) {
        return fmi3Error;
    }
    for (k = 0; k < 4; k++) {
        const double start = u->now.number[DEPTH_MM + k];
        u->now.followed[k] = isfinite(start) ? start : 0.0;
    }
    u->phase = STEPPING;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    unit *u = (unit *)instance;
    if (u == NULL || u->phase != STEPPING) {
        return fmi3Error;
    }
    u->phase = TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    if (instance == NULL) {
        return fmi3Error;
    }
    begin((unit *)instance);
    return fmi3OK;
}

/* ---- Numbers ---- */

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          fmi3Float64 values[], size_t nValues)
{
    const unit *u = (const unit *)instance;
    size_t i;
    if (u == NULL || nValues != nValueReferences) {
        return fmi3Error;
    }
    for (i = 0; i < nValues; i++) {
        if (valueReferences[i] >= OUTPUTS_END) {
            return say(u, fmi3Error, "no 64-bit float has the value reference %u", (unsigned)valueReferences[i]);
        }
        values[i] = u->now.number[valueReferences[i]];
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                          const fmi3Float64 values[], size_t nValues)
{
    unit *u = (unit *)instance;
    size_t i;
    if (u == NULL || nValues != nValueReferences) {
        return fmi3Error;
    }
    for (i = 0; i < nValues; i++) {
        const fmi3ValueReference r = valueReferences[i];
        const int is_input = (r > TIME && r <= STRENGTH_FACTOR) || (r >= HYDRATION_AU && r < INPUTS_END);
        const int is_parameter = r >= SIZE && r < PARAMETERS_END;
        if (!is_input && !(is_parameter && u->phase <= INITIALIZATION)) {
            if (is_parameter) {
                return say(u, fmi3Error, "%s is a fixed parameter: it can be set until the initialization ends, and keeps %g",
                           TUNING[r - SIZE].name, u->now.number[r]);
            }
            return say(u, fmi3Error, "the variable with the value reference %u is not an input or a parameter", (unsigned)r);
        }
        u->now.number[r] = values[i];
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance instance, const fmi3ValueReference valueReferences[], size_t nValueReferences,
                        fmi3Int32 values[], size_t nValues)
{
    const unit *u = (const unit *)instance;
    size_t i;
    if (u == NULL || nValues != nValueReferences) {
        return fmi3Error;
    }
    for (i = 0; i < nValues; i++) {
        switch (valueReferences[i]) {
        case REGIME:
            values[i] = u->now.regime;
            break;
        case STATUS:
            values[i] = u->now.status;
            break;
        case SUBSTEPS:
            values[i] = u->now.substeps;
            break;
        default:
            return say(u, fmi3Error, "no integer has the value reference %u", (unsigned)valueReferences[i]);
        }
    }
    return fmi3OK;
}

/* ---- Step ---- */

static void keep(memory *m, const fingerpad_response *r)
{
    double *n = m->number;
    n[NORMAL_FORCE_N] = (double)r->normal_force_n;
    n[FRICTION_X_N] = (double)r->friction_x_n;
    n[FRICTION_Y_N] = (double)r->friction_y_n;
    n[SPIN_MOMENT_N_MM] = (double)r->spin_moment_n_mm;
    n[STICK_RATIO] = (double)r->stick_ratio;
    n[FRICTION_LIMIT_N] = (double)r->friction_limit_n;
    n[SLIP_MARGIN] = (double)r->slip_margin;
    n[PRESSURE_CENTRE_X_MM] = (double)r->pressure_centre_x_mm;
    n[PRESSURE_CENTRE_Y_MM] = (double)r->pressure_centre_y_mm;
    n[CONTACT_AREA_MM2] = (double)r->contact_area_mm2;
    n[BAND_NORMAL_N] = (double)r->band_normal_n;
    n[BAND_FRICTION_N] = (double)r->band_friction_n;
    m->regime = (int32_t)r->regime;
}

/* Brings the strength up to the input; a factor out of range is refused before anything has changed. */
static fmi3Status set_up_step(unit *u)
{
    const double *n = u->now.number;
    int32_t code;
    if (!in_range(u, &STRENGTH, fmi3Discard)) {
        return fmi3Discard;
    }
    code = fingerpad_spin_state_set_strength_factor(&u->now.state, (float)n[STRENGTH_FACTOR]);
    if (code == FINGERPAD_OK) {
        code = fingerpad_contact_set_strength_factor(&u->now.contact, (float)n[STRENGTH_FACTOR]);
    }
    if (code != FINGERPAD_OK) {
        return say(u, fmi3Discard, "strength_factor %g: %s", n[STRENGTH_FACTOR], fingerpad_error_text(code));
    }
    return fmi3OK;
}

/* A change that single precision holds; others are bad input, which the step reports. */
static int is_followed(double change)
{
    return isfinite((float)change);
}

/* The number of equal substeps to the depth, place and angle of the inputs. */
static int32_t substeps(const memory *m)
{
    static const double arms[4] = {1.0, 1.0, 1.0, ARM_MM};
    double sum_mm = 0.0;
    double count;
    int k;
    for (k = 0; k < 4; k++) {
        const double change = m->number[DEPTH_MM + k] - m->followed[k];
        sum_mm += is_followed(change) ? arms[k] * fabs(change) : 0.0;
    }
    count = ceil(sum_mm / SUBSTEP_MM);
    return count < 1.0 ? 1 : count > SUBSTEPS_MAX ? (int32_t)SUBSTEPS_MAX : (int32_t)count;
}

/* The motion of substep `i` of `count`, counted from 1, along the line from `from` to the inputs. */
static fingerpad_motion part(memory *m, const double *from, int32_t i, int32_t count)
{
    fingerpad_motion motion = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
    float increment[4];
    int k;
    for (k = 0; k < 4; k++) {
        const double whole = m->number[DEPTH_MM + k] - from[k];
        double to = m->number[DEPTH_MM + k];
        if (is_followed(whole) && i < count) {
            to = from[k] + whole * (double)i / (double)count;
        }
        increment[k] = (float)(to - m->followed[k]);
        if (k == 0) {
            motion.depth_mm = (float)to;
            m->followed[k] = is_followed(whole) ? to : m->followed[k];
        } else if (is_followed(whole)) {
            m->followed[k] += (double)increment[k];
        }
    }
    motion.slide_x_mm = increment[1];
    motion.slide_y_mm = increment[2];
    motion.spin_rad = increment[3];
    return motion;
}

static int32_t step(unit *u, fingerpad_motion motion, fingerpad_response *r)
{
    memory *m = &u->now;
    fingerpad_surroundings around;
    int k;
    if (u->info.effects == 0) {
        return fingerpad_spin_step(&u->model, &m->state, motion, r);
    }
    (void)fingerpad_surroundings_default(&around);
    around.hydration_au = (float)m->number[HYDRATION_AU];
    around.temperature_c = (float)m->number[TEMPERATURE_C];
    around.finger_width_mm = (float)m->number[FINGER_WIDTH_MM];
    around.series_s = (float)m->number[SERIES_S];
    for (k = 0; k < INPUTS_END - OWN; k++) {
        around.own[k] = (float)m->number[OWN + k];
    }
    return fingerpad_contact_step(&u->model, &m->contact, around, motion, r);
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 currentCommunicationPoint, fmi3Float64 communicationStepSize,
                      fmi3Boolean noSetFMUStatePriorToCurrentPoint, fmi3Boolean *eventHandlingNeeded,
                      fmi3Boolean *terminateSimulation, fmi3Boolean *earlyReturn, fmi3Float64 *lastSuccessfulTime)
{
    unit *u = (unit *)instance;
    fingerpad_motion motion;
    fingerpad_response r;
    double from[4];
    int32_t code, count, i;
    int32_t status = 0;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (u == NULL || u->phase != STEPPING) {
        return fmi3Error;
    }
    *eventHandlingNeeded = *terminateSimulation = *earlyReturn = fmi3False;
    *lastSuccessfulTime = currentCommunicationPoint;
    if (!(communicationStepSize > 0.0 && isfinite(communicationStepSize) && isfinite(currentCommunicationPoint))) {
        return say(u, fmi3Error, "a step of %g s from %g s; both must be finite, and the step greater than 0",
                   communicationStepSize, currentCommunicationPoint);
    }
    if (set_up_step(u) != fmi3OK) {
        return fmi3Discard;
    }
    count = substeps(&u->now);
    (void)memcpy(from, u->now.followed, sizeof from);
    for (i = 1; i <= count; i++) {
        motion = part(&u->now, from, i, count);
        motion.dt_s = (float)(communicationStepSize / (double)count);
        code = step(u, motion, &r);
        if (code != FINGERPAD_OK) {
            return say(u, fmi3Error, "%s", fingerpad_error_text(code));
        }
        status |= r.status;
    }
    keep(&u->now, &r);
    u->now.status = status;
    u->now.substeps = count;
    u->now.number[TIME] = *lastSuccessfulTime = currentCommunicationPoint + communicationStepSize;
    if ((status & (FINGERPAD_STATUS_BAD_INPUT | FINGERPAD_STATUS_MEMORY_LOST)) != 0) {
        return say(u, fmi3Warning, "depth_mm %g, slide_x_mm %g, slide_y_mm %g, spin_rad %g: the step leaves out those that are not finite",
                   u->now.number[DEPTH_MM], u->now.number[SLIDE_X_MM], u->now.number[SLIDE_Y_MM], u->now.number[SPIN_RAD]);
    }
    return fmi3OK;
}

/* ---- State ---- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    const unit *u = (const unit *)instance;
    if (u == NULL || FMUState == NULL) {
        return fmi3Error;
    }
    if (*FMUState == NULL) {
        *FMUState = calloc(1, sizeof(memory));
    }
    if (*FMUState == NULL) {
        return say(u, fmi3Error, "no memory for a state");
    }
    (void)memcpy(*FMUState, &u->now, sizeof u->now);
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState FMUState)
{
    unit *u = (unit *)instance;
    if (u == NULL || FMUState == NULL) {
        return fmi3Error;
    }
    (void)memcpy(&u->now, FMUState, sizeof u->now);
    return tune(u);
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *FMUState)
{
    if (instance == NULL || FMUState == NULL) {
        return fmi3Error;
    }
    free(*FMUState);
    *FMUState = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState FMUState, size_t *size)
{
    if (instance == NULL || FMUState == NULL || size == NULL) {
        return fmi3Error;
    }
    *size = sizeof(serialized);
    return fmi3OK;
}

/* Fletcher's sum of a state's bytes. */
static uint32_t checksum(const memory *inside)
{
    const uint8_t *bytes = (const uint8_t *)inside;
    uint32_t a = 1, b = 0;
    size_t i;
    for (i = 0; i < sizeof *inside; i++) {
        a = (a + bytes[i]) % 65521;
        b = (b + a) % 65521;
    }
    return b << 16 | a;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState FMUState, fmi3Byte serializedState[], size_t size)
{
    const unit *u = (const unit *)instance;
    serialized s;
    if (u == NULL || FMUState == NULL || serializedState == NULL) {
        return fmi3Error;
    }
    if (size < sizeof s) {
        return say(u, fmi3Error, "a state takes %u bytes, the buffer has %u", (unsigned)sizeof s, (unsigned)size);
    }
    (void)memset(&s, 0, sizeof s);
    s.magic = MAGIC;
    s.version = VERSION;
    s.model = u->info.checksum;
    (void)memcpy(&s.inside, FMUState, sizeof s.inside);
    s.checksum = checksum(&s.inside);
    (void)memcpy(serializedState, &s, sizeof s);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte serializedState[], size_t size,
                                   fmi3FMUState *FMUState)
{
    const unit *u = (const unit *)instance;
    serialized s;
    if (u == NULL || FMUState == NULL || serializedState == NULL) {
        return fmi3Error;
    }
    if (size != sizeof s) {
        return say(u, fmi3Error, "a state takes %u bytes, not %u", (unsigned)sizeof s, (unsigned)size);
    }
    (void)memcpy(&s, serializedState, sizeof s);
    if (s.magic != MAGIC || s.version != VERSION || s.model != u->info.checksum || s.checksum != checksum(&s.inside)) {
        return say(u, fmi3Error, "the bytes are not a state of this model, or they are damaged");
    }
    if (*FMUState == NULL) {
        *FMUState = calloc(1, sizeof(memory));
    }
    if (*FMUState == NULL) {
        return say(u, fmi3Error, "no memory for a state");
    }
    (void)memcpy(*FMUState, &s.inside, sizeof s.inside);
    return fmi3OK;
}

/* ---- The rest of what every unit has ---- */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean loggingOn, size_t nCategories,
                               const fmi3String categories[])
{
    (void)nCategories, (void)categories;
    if (instance == NULL) {
        return fmi3Error;
    }
    ((unit *)instance)->logging = loggingOn;
    return fmi3OK;
}
