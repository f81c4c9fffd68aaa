/* Follows the calls of a caller through the states of FMI 2.0 (section 4.2.4) or, with the macro THREE, of FMI 3.0 (sections 2.3 and
   4.2.1), counts those that are illegal, and says which call it was in which state. One variable is the count, the other the time. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

enum { INSTANTIATED = 1, SET_UP = 2, CONFIGURATION = 4, INITIALIZATION = 8, STEP = 16, DISCARDED = 32, TERMINATED = 64 };
enum { ALL = 127, MOST = 64 };
static const char *const NAMES[] = {"instantiated", "set up", "configuration", "initialization", "step", "discarded step", "terminated"};

typedef void Log3(void *environment, int status, const char *category, const char *message);
typedef struct {
    int phase;
    double time;
} State;
typedef struct {
    Callbacks callbacks;
    Log3 *log;
    void *environment;
    State now;
    /* The caller promised not to go back before this time. */
    double promised;
    State *states[MOST];
    int steps;
} Model;

static int violations;

static int tell(Model *m, const char *call, const char *what) {
    char text[256];
    int phase = 0;
    while ((1 << phase) < m->now.phase) phase++;
    snprintf(text, sizeof text, "%s is illegal in the state %s: %s", call, NAMES[phase], what);
    violations++;
    if (m->log) m->log(m->environment, ERROR, "logStatusError", text);
    else m->callbacks.logger(m->callbacks.environment, "lawful", ERROR, "logStatusError", "%s", text);
    return ERROR;
}
static int law(Model *m, const char *call, int allowed) {
    return m->now.phase & allowed ? OK : tell(m, call, "not now");
}
static int go(Model *m, const char *call, int from, int to) {
    if (law(m, call, from)) return ERROR;
    m->now.phase = to;
    return OK;
}
static State **find(Model *m, const void *state) {
    for (int i = 0; i < MOST; i++)
        if (m->states[i] == state) return &m->states[i];
    return NULL;
}
static int keep(Model *m, void **state, State value, const char *call) {
    if (*state == NULL) {
        State **place = find(m, NULL);
        if (!place) return tell(m, call, "too many states");
        *state = *place = malloc(sizeof(State));
    } else if (!find(m, *state)) return tell(m, call, "a state that is not mine");
    *(State *)*state = value;
    return OK;
}
static int take(Model *m, void **state, const char *call) { return keep(m, state, m->now, call); }
static int put_back(Model *m, void *state, const char *call) {
    if (!state || !find(m, state)) return tell(m, call, "a state that is not mine");
    if (((State *)state)->time < m->promised) return tell(m, call, "a time before the one promised by a step");
    m->now = *(State *)state;
    return OK;
}
static int let_go(Model *m, void **state, const char *call) {
    if (!*state) return OK;
    State **place = find(m, *state);
    if (!place) return tell(m, call, "a state that is not mine");
    free(*state);
    *state = *place = NULL;
    return OK;
}
static int step(Model *m, const char *call, double time, double size, bool no_way_back, double *reached) {
    if (law(m, call, STEP)) return ERROR;
    if (fabs(time - m->now.time) > 1e-9) return tell(m, call, "the step does not begin where the last one ended");
    if (size <= 0.0) return tell(m, call, "the step has no size");
    if (no_way_back) m->promised = time;
    /* Each seventh step is discarded half way. */
    if (++m->steps % 7 == 0) {
        *reached = m->now.time = time + size / 2;
        m->now.phase = DISCARDED;
        return DISCARD;
    }
    *reached = m->now.time = time + size;
    return OK;
}
static void end(Model *m, const char *call) {
    for (int i = 0; i < MOST; i++)
        if (m->states[i]) {
            tell(m, call, "a state was not freed");
            free(m->states[i]);
        }
}
static int values(Model *m, const char *call, const unsigned *references, size_t n, double *found, int allowed) {
    if (law(m, call, allowed)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (references[i] > 1) return tell(m, call, "an unknown reference");
        found[i] = references[i] == 0 ? violations : m->now.time;
    }
    return OK;
}

#if defined THREE
#define NAME(SUFFIX) fmi3##SUFFIX
#define STATE(VERB) fmi3##VERB##FMUState
#define DESERIALIZE fmi3DeserializeFMUState
#define SIZE fmi3SerializedFMUStateSize
const char *fmi3GetVersion(void) { return "3.0"; }
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool event_mode, bool early_return, const uint32_t *intermediate, size_t count,
                                  void *environment, Log3 *log, void *update) {
    Model *m = calloc(1, sizeof(Model));
    *m = (Model){.log = log, .environment = environment, .now = {INSTANTIATED, 0.0}, .promised = -INFINITY};
    if (!*name || strcmp(token, "{lawful}") || event_mode || early_return || count) tell(m, __func__, "wrong arguments");
    return m;
}
int fmi3EnterConfigurationMode(void *m) { return go(m, __func__, INSTANTIATED, CONFIGURATION); }
int fmi3ExitConfigurationMode(void *m) { return go(m, __func__, CONFIGURATION, INSTANTIATED); }
int fmi3EnterInitializationMode(void *c, bool tolerant, double tolerance, double start, bool stops, double stop) {
    ((Model *)c)->now.time = start;
    return go(c, __func__, INSTANTIATED, INITIALIZATION);
}
int fmi3DoStep(void *c, double time, double size, bool no_way_back, bool *event, bool *terminate, bool *early, double *reached) {
    *event = *terminate = *early = false;
    return step(c, __func__, time, size, no_way_back, reached);
}
int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const *categories) { return law(c, __func__, ALL); }
int fmi3GetFloat64(void *c, const unsigned *r, size_t n, double *v, size_t s) {
    return n == s ? values(c, __func__, r, n, v, ALL) : tell(c, __func__, "another number of values");
}
int fmi3SetFloat64(void *c, const unsigned *r, size_t n, const double *v, size_t s) {
    return n == s && r[0] == 2 ? law(c, __func__, INSTANTIATED | INITIALIZATION | STEP) : tell(c, __func__, "no input");
}
#define ABSENT(TYPE)                                                                                                   \
    int fmi3Get##TYPE(void *c) { return tell(c, __func__, "no such variable"); }                                       \
    int fmi3Set##TYPE(void *c) { return tell(c, __func__, "no such variable"); }
ABSENT(Float32) ABSENT(Int8) ABSENT(UInt8) ABSENT(Int16) ABSENT(UInt16) ABSENT(Int32) ABSENT(UInt32) ABSENT(Int64)
ABSENT(UInt64) ABSENT(Boolean) ABSENT(String) ABSENT(Binary)
#else
#define NAME(SUFFIX) fmi2##SUFFIX
#define STATE(VERB) fmi2##VERB##FMUstate
#define DESERIALIZE fmi2DeSerializeFMUstate
#define SIZE fmi2SerializedFMUstateSize
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    Model *m = calloc(1, sizeof(Model));
    *m = (Model){.callbacks = *callbacks, .now = {INSTANTIATED, 0.0}, .promised = -INFINITY};
    if (!*name || type != 1 || strcmp(guid, "{lawful}")) tell(m, __func__, "wrong arguments");
    return m;
}
int fmi2SetupExperiment(void *c, int with, double tolerance, double start, int ends, double stop) {
    ((Model *)c)->now.time = start;
    return go(c, __func__, INSTANTIATED | SET_UP, SET_UP);
}
int fmi2EnterInitializationMode(void *m) { return go(m, __func__, SET_UP, INITIALIZATION); }
int fmi2DoStep(void *c, double time, double size, int no_way_back) {
    double reached;
    return step(c, __func__, time, size, no_way_back, &reached);
}
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *categories) { return law(c, __func__, ALL); }
int fmi2GetRealStatus(void *c, int kind, double *value) {
    if (law(c, __func__, DISCARDED)) return ERROR;
    *value = ((Model *)c)->now.time;
    return OK;
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    *value = 0;
    return law(c, __func__, DISCARDED);
}
int fmi2GetReal(void *c, const unsigned *r, size_t n, double *v) {
    return values(c, __func__, r, n, v, ALL & ~(INSTANTIATED | SET_UP));
}
int fmi2SetReal(void *c, const unsigned *r, size_t n, const double *v) {
    return r[0] == 2 ? law(c, __func__, INSTANTIATED | SET_UP | INITIALIZATION | STEP) : tell(c, __func__, "no input");
}
#define ABSENT(TYPE)                                                                                                   \
    int fmi2Get##TYPE(void *c) { return tell(c, __func__, "no such variable"); }                                       \
    int fmi2Set##TYPE(void *c) { return tell(c, __func__, "no such variable"); }
ABSENT(Integer) ABSENT(Boolean) ABSENT(String)
#endif

int NAME(ExitInitializationMode)(void *m) { return go(m, __func__, INITIALIZATION, STEP); }
int NAME(Terminate)(void *m) { return go(m, __func__, STEP | DISCARDED, TERMINATED); }
int NAME(Reset)(void *c) {
    Model *m = c;
    if (law(m, __func__, ALL)) return ERROR;
#if defined STUBBORN
    return tell(m, __func__, "no reset");
#endif
    m->now = (State){INSTANTIATED, 0.0};
    m->promised = -INFINITY;
    return OK;
}
void NAME(FreeInstance)(void *c) {
    Model *m = c;
    end(m, __func__);
    free(m);
}
int STATE(Get)(void *m, void **state) { return take(m, state, __func__); }
int STATE(Set)(void *m, void *state) { return put_back(m, state, __func__); }
int STATE(Free)(void *m, void **state) { return let_go(m, state, __func__); }
int SIZE(void *m, void *state, size_t *size) {
    *size = sizeof(State);
    return find(m, state) ? OK : tell(m, __func__, "a state that is not mine");
}
int STATE(Serialize)(void *m, void *state, char *bytes, size_t size) {
    if (!find(m, state) || size != sizeof(State)) return tell(m, __func__, "a state that is not mine");
    memcpy(bytes, state, size);
    return OK;
}
int DESERIALIZE(void *m, const char *bytes, size_t size, void **state) {
    if (size != sizeof(State)) return tell(m, __func__, "other bytes");
    State value;
    memcpy(&value, bytes, size);
    return keep(m, state, value, __func__);
}
