/* Keeps the rules of FMI 3.0, but for the one that the macro given to the compiler breaks: x follows gain * u, y = x + u / 2, and
   v = x + w by element. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#if defined BREAKS
#define IS(deviation) (strcmp(BREAKS, deviation) == 0)
#else
#define IS(deviation) 0
#endif

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { MOST = 4 };
enum { Y, U, GAIN, N, V, STEPS, ON, LABEL, W };
enum { INSTANTIATED = 1, CONFIGURATION = 2, INITIALIZATION = 4, EVENT = 8, STEP = 16, RECONFIGURATION = 32, TERMINATED = 64, FAILED = 128 };
enum { ANY = 255, WRITABLE = INSTANTIATED | INITIALIZATION | STEP | EVENT };

typedef void Log(void *environment, int status, const char *category, const char *message);
/* What an FMU state holds. */
typedef struct {
    double time, stop, x, u, gain, w[MOST];
    uint64_t n;
    int state, steps, on;
} Values;
typedef struct {
    Log *log;
    void *environment;
    bool logging, event_mode;
    char name[64];
    Values now;
} Model;

static double shared;
static int calls;

static int fail(Model *m, const char *text) {
    /* A call that is refused in configuration mode leaves the mode as it is. */
    m->now.state = FAILED;
    m->log(m->environment, ERROR, IS("a category that is not declared") ? "chatter" : "logStatusError", text);
    return ERROR;
}
static int illegal(Model *m, int allowed) {
    if (m->now.state & allowed || IS("illegal calls are accepted")) return 0;
    return fail(m, "this call is not allowed now");
}
static Values fresh(void) {
    return (Values){.gain = IS("another start value") ? 2.5 : 2.0, .n = 2, .state = INSTANTIATED};
}

const char *fmi3GetVersion(void) { return IS("another version") ? "2.0" : "3.0"; }
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const *categories) {
    if (n > 0 && IS("a category is refused")) return fail(c, "no such category");
    ((Model *)c)->logging = on;
    return OK;
}
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool event_mode, bool early_return, const uint32_t *intermediate, size_t count,
                                  void *environment, Log *log, void *update) {
    if (strcmp(token, "{deviate3}") && !IS("any token is accepted")) {
        log(environment, ERROR, "logStatusError", "another token than mine");
        return NULL;
    }
    if (event_mode && IS("event mode is refused")) return NULL;
    Model *m = calloc(1, sizeof(Model));
    *m = (Model){.log = log, .environment = environment, .logging = logging, .event_mode = event_mode, .now = fresh()};
    strncpy(m->name, name, sizeof m->name - 1);
    if (IS("a kilobyte is lost")) memset(malloc(1024), 1, 1024);
    if (logging || IS("logging that nobody wants")) log(environment, OK, "logAll", "here I am");
    return m;
}
void fmi3FreeInstance(void *c) { free(c); }

int fmi3EnterConfigurationMode(void *c) {
    Model *m = c;
    if (illegal(m, INSTANTIATED | STEP)) return ERROR;
    m->now.state = m->now.state == INSTANTIATED ? CONFIGURATION : RECONFIGURATION;
    return OK;
}
int fmi3ExitConfigurationMode(void *c) {
    Model *m = c;
    if (illegal(m, CONFIGURATION | RECONFIGURATION)) return ERROR;
    m->now.state = m->now.state == CONFIGURATION ? INSTANTIATED : STEP;
    return OK;
}
int fmi3EnterInitializationMode(void *c, bool tolerant, double tolerance, double start, bool stops, double stop) {
    Model *m = c;
    if (illegal(m, INSTANTIATED)) return ERROR;
    m->now.time = start;
    m->now.stop = stops ? stop : INFINITY;
    m->now.state = INITIALIZATION;
    return OK;
}
int fmi3ExitInitializationMode(void *c) {
    Model *m = c;
    if (illegal(m, INITIALIZATION)) return ERROR;
    m->now.state = m->event_mode ? EVENT : STEP;
    if (IS("state is shared")) shared = 0.0;
    return OK;
}
int fmi3EnterEventMode(void *c) {
    Model *m = c;
    if (illegal(m, m->event_mode ? STEP : 0)) return ERROR;
    m->now.state = EVENT;
    return OK;
}
int fmi3UpdateDiscreteStates(void *c, bool *again, bool *end, bool *nominals, bool *values, bool *timed, double *next) {
    if (illegal(c, EVENT)) return ERROR;
    *again = IS("event mode never rests");
    *end = *nominals = *values = *timed = false;
    return OK;
}
int fmi3EnterStepMode(void *c) {
    if (illegal(c, EVENT)) return ERROR;
    ((Model *)c)->now.state = STEP;
    return OK;
}
int fmi3Terminate(void *c) {
    if (illegal(c, STEP | EVENT)) return ERROR;
    ((Model *)c)->now.state = TERMINATED;
    return OK;
}
int fmi3Reset(void *c) {
    Model *m = c;
    double x = m->now.x;
    m->now = fresh();
    if (IS("a reset forgets to reset")) m->now.x = x;
    return OK;
}
int fmi3DoStep(void *c, double time, double step, bool no_way_back, bool *event, bool *terminate, bool *early, double *reached) {
    Model *m = c;
    Values *now = &m->now;
    *event = *terminate = *early = false;
    if (illegal(m, STEP)) return ERROR;
    while (IS("a step takes for ever")) pause();
    if (fabs(time - now->time) > 1e-9) return fail(m, "this is not where the last step ended");
    if (fabs(step - 0.1) > 1e-9 && IS("one step size only")) return fail(m, "I step by 0.1 s");
    if (time + step > now->stop + 1e-9 && !IS("the stop time is passed")) return fail(m, "this is past the stop time");
    if (time + step > now->stop - 1e-9 && IS("the last step is refused")) return fail(m, "this is too close to the stop time");
    now->x += now->gain * now->u * (IS("the step size is ignored") ? 0.1 : step);
    if (IS("state is shared")) now->x = shared += now->u * step;
    if (IS("chance")) now->x += 1e-9 * ++calls;
    now->steps++;
    *reached = now->time = time + step;
    *event = m->event_mode && now->steps % 4 == 0;
    return OK;
}

/* Whether `size` values are those that the references of the call have. */
static int counted(Model *m, size_t place, size_t size) {
    return place == size || IS("another number of values is accepted") ? OK : fail(m, "another number of values");
}
static size_t elements(Model *m) { return IS("arrays keep their size") ? 2 : m->now.n; }

int fmi3GetFloat64(void *c, const uint32_t *references, size_t count, double *values, size_t size) {
    Model *m = c;
    size_t place = 0;
    if (illegal(m, ANY & ~FAILED)) return ERROR;
    if (IS("a crash") && m->now.state == STEP) *(volatile int *)NULL = 0;
    for (size_t i = 0; i < count; i++) switch (references[i]) {
        case Y: values[place++] = IS("no number") && m->now.steps > 30 ? NAN : m->now.x + 0.5 * m->now.u; break;
        case U: values[place++] = m->now.u; break;
        case GAIN: values[place++] = m->now.gain; break;
        case V: case W:
            if (size - place < elements(m) && !IS("another number of values is accepted")) return fail(m, "too few values");
            for (size_t k = 0; k < elements(m) && place < size; k++)
                values[place++] = (references[i] == V ? m->now.x : 0.0) + m->now.w[k];
            break;
        default:
            if (IS("an unknown reference is read")) values[place++] = *(volatile double *)NULL;
            if (IS("an unknown reference is accepted")) { values[place++] = 0.0; break; }
            return fail(m, "no Float64 has this reference");
        }
    return counted(m, place, size);
}
int fmi3SetFloat64(void *c, const uint32_t *references, size_t count, const double *values, size_t size) {
    Model *m = c;
    size_t place = 0;
    if (illegal(m, WRITABLE)) return ERROR;
    for (size_t i = 0; i < count; i++) switch (references[i]) {
        case U:
            if (m->now.state == INITIALIZATION && IS("an input is refused")) return fail(m, "not this input, not now");
            m->now.u = values[place++];
            break;
        case GAIN:
            if (m->now.state & (STEP | EVENT) && !IS("a fixed parameter moves")) return fail(m, "the gain is fixed");
            m->now.gain = values[place++];
            break;
        case W:
            for (size_t k = 0; k < elements(m) && place < size; k++) m->now.w[k] = values[place++];
            break;
        case Y:
            if (IS("an output can be set")) { m->now.x = values[place++]; break; }
            return fail(m, "this cannot be set");
        default: return fail(m, "this cannot be set");
        }
    return counted(m, place, size);
}
int fmi3GetFloat32(void *c, const uint32_t *references, size_t count, float *values, size_t size) {
    if (IS("another type is read") && references[0] == Y) {
        values[0] = (float)((Model *)c)->now.x;
        return OK;
    }
    return fail(c, "no Float32 has this reference");
}
int fmi3SetFloat32(void *c, const uint32_t *references, size_t count, const float *values, size_t size) {
    return fail(c, "no Float32 has this reference");
}
int fmi3GetUInt64(void *c, const uint32_t *references, size_t count, uint64_t *values, size_t size) {
    Model *m = c;
    if (illegal(m, ANY & ~FAILED)) return ERROR;
    if (count != 1 || references[0] != N) return fail(m, "no UInt64 has this reference");
    values[0] = m->now.n;
    return counted(m, 1, size);
}
int fmi3SetUInt64(void *c, const uint32_t *references, size_t count, const uint64_t *values, size_t size) {
    Model *m = c;
    if (illegal(m, CONFIGURATION | RECONFIGURATION)) return ERROR;
    if (count != 1 || references[0] != N || values[0] > MOST) return fail(m, "n is at most 4");
    m->now.n = values[0];
    return counted(m, 1, size);
}
int fmi3GetInt32(void *c, const uint32_t *references, size_t count, int32_t *values, size_t size) {
    if (illegal(c, ANY & ~FAILED)) return ERROR;
    if (count != 1 || references[0] != STEPS) return fail(c, "no Int32 has this reference");
    values[0] = ((Model *)c)->now.steps;
    return counted(c, 1, size);
}
int fmi3SetInt32(void *c, const uint32_t *r, size_t n, const int32_t *v, size_t s) { return fail(c, "no Int32 can be set"); }
int fmi3GetBoolean(void *c, const uint32_t *references, size_t count, bool *values, size_t size) {
    if (illegal(c, ANY & ~FAILED)) return ERROR;
    if (count != 1 || references[0] != ON) return fail(c, "no Boolean has this reference");
    values[0] = ((Model *)c)->now.on;
    return counted(c, 1, size);
}
int fmi3SetBoolean(void *c, const uint32_t *references, size_t count, const bool *values, size_t size) {
    if (illegal(c, WRITABLE)) return ERROR;
    if (count != 1 || references[0] != ON) return fail(c, "no Boolean has this reference");
    ((Model *)c)->now.on = values[0];
    return counted(c, 1, size);
}
int fmi3GetString(void *c, const uint32_t *references, size_t count, const char **values, size_t size) {
    if (illegal(c, ANY & ~FAILED)) return ERROR;
    if (count != 1 || references[0] != LABEL) return fail(c, "no String has this reference");
    values[0] = "tank";
    return counted(c, 1, size);
}
int fmi3SetString(void *c, const uint32_t *r, size_t n, const char *const *v, size_t s) { return fail(c, "no String can be set"); }
int fmi3GetBinary(void *c, const uint32_t *r, size_t n, size_t *sizes, const uint8_t **v, size_t s) { return fail(c, "no Binary"); }
int fmi3SetBinary(void *c, const uint32_t *r, size_t n, const size_t *sizes, const uint8_t *const *v, size_t s) { return fail(c, "no Binary"); }

#define ABSENT(TYPE, NAME)                                                                                             \
    int fmi3Get##NAME(void *c, const uint32_t *r, size_t n, TYPE *v, size_t s) { return fail(c, "no " #NAME); }         \
    int fmi3Set##NAME(void *c, const uint32_t *r, size_t n, const TYPE *v, size_t s) { return fail(c, "no " #NAME); }
ABSENT(int8_t, Int8)
ABSENT(uint8_t, UInt8)
ABSENT(int16_t, Int16)
ABSENT(uint16_t, UInt16)
ABSENT(uint32_t, UInt32)
ABSENT(int64_t, Int64)

int fmi3GetFMUState(void *c, void **state) {
    if (((Model *)c)->now.state == INITIALIZATION && IS("no state before the first step")) return fail(c, "there is no state yet");
    if (!*state) *state = malloc(sizeof(Values));
    memcpy(*state, &((Model *)c)->now, sizeof(Values));
    return OK;
}
int fmi3SetFMUState(void *c, void *state) {
    Model *m = c;
    double x = m->now.x;
    bool failed = m->now.state == FAILED;
    memcpy(&m->now, state, sizeof(Values));
    if (failed && IS("an error is for ever")) m->now.state = FAILED;
    if (IS("a state forgets")) m->now.x = x;
    return OK;
}
int fmi3FreeFMUState(void *c, void **state) {
    free(*state);
    *state = NULL;
    return OK;
}
int fmi3SerializedFMUStateSize(void *c, void *state, size_t *size) {
    *size = sizeof(Values);
    return OK;
}
int fmi3SerializeFMUState(void *c, void *state, uint8_t *bytes, size_t size) {
    memcpy(bytes, state, size);
    return OK;
}
int fmi3DeserializeFMUState(void *c, const uint8_t *bytes, size_t size, void **state) {
    *state = malloc(size);
    memcpy(*state, bytes, size);
    if (IS("bytes forget")) ((Values *)*state)->x = 0.0;
    return OK;
}

/* The derivatives of y and v with respect to u and w: 1/2, and the unit matrix. */
static int sensitivity(Model *m, uint32_t unknown, uint32_t known, const double *seed, size_t seeds, double *value, size_t count, double half) {
    if (illegal(m, ANY & ~(INSTANTIATED | FAILED))) return ERROR;
    if (IS("no derivative")) return fail(m, "not supported");
    for (size_t i = 0; i < count; i++) value[i] = 0.0;
    if (unknown == Y && known == U) value[0] = half * seed[0];
    if (unknown == V && known == W)
        for (size_t i = 0; i < count; i++) value[i] = seed[i];
    return OK;
}
int fmi3GetDirectionalDerivative(void *c, const uint32_t *unknown, size_t unknowns, const uint32_t *known, size_t knowns,
                                 const double *seed, size_t seeds, double *value, size_t count) {
    return sensitivity(c, unknown[0], known[0], seed, seeds, value, count, IS("a wrong derivative") ? 0.6 : 0.5);
}
int fmi3GetAdjointDerivative(void *c, const uint32_t *unknown, size_t unknowns, const uint32_t *known, size_t knowns,
                             const double *seed, size_t seeds, double *value, size_t count) {
    return sensitivity(c, unknown[0], known[0], seed, seeds, value, count, IS("a wrong adjoint derivative") ? 0.6 : 0.5);
}
int fmi3GetOutputDerivatives(void *c, const uint32_t *references, size_t count, const int32_t *orders, double *values, size_t size) {
    if (illegal(c, STEP | TERMINATED)) return ERROR;
    if (IS("no slope")) return fail(c, "not supported");
    for (size_t i = 0; i < size; i++) values[i] = 0.0;
    return OK;
}

/* What the model has no use for. */
#define USELESS(NAME) int fmi3##NAME(void *c) { return fail(c, "not supported"); }
USELESS(GetClock)
USELESS(SetClock)
USELESS(GetNumberOfVariableDependencies)
USELESS(GetVariableDependencies)
USELESS(GetIntervalDecimal)
USELESS(GetIntervalFraction)
USELESS(GetShiftDecimal)
USELESS(GetShiftFraction)
USELESS(SetIntervalDecimal)
USELESS(SetIntervalFraction)
USELESS(SetShiftDecimal)
USELESS(SetShiftFraction)
USELESS(EvaluateDiscreteStates)
