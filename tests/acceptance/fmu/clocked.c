/* An FMU of FMI 3.0 with event mode, clocks and intermediate updates. It refuses what the standard forbids: discrete inputs in step mode,
   values of a clock that does not tick, calls out of order. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { SAMPLE, U, SAMPLED, COUNT, ALARM, NOTE, RESET, SLOWER, SLOW_TICKS, FUSE, BURNT, MODE, SHOWN_MODE, UPDATES, BEHAVIOUR, VARIABLES };
/* What `behaviour` asks for. */
enum { GOOD, ENDLESS, EARLY, STUCK, DIVIDES, ENDS };
enum { INSTANTIATED, INITIALIZATION, EVENT, STEP, ENDED };

typedef void Log(void *environment, int status, const char *category, const char *message);
typedef void Update(void *environment, double time, bool set_requested, bool get_allowed, bool step_finished, bool can_return_early,
                    bool *early_return_requested, double *early_return_time);
typedef struct {
    Log *log;
    Update *update;
    void *environment;
    int state;
    bool active[VARIABLES];
    double time, u, sampled, interval;
    bool interval_changed, fuse_lit, alarmed;
    int32_t count, slow_ticks, burnt, mode, shown_mode, updates, behaviour;
    char note[32];
} Model;

static int refuse(Model *m, const char *what) {
    m->log(m->environment, ERROR, "logStatusError", what);
    return ERROR;
}
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool event_mode, bool early_return, const uint32_t *intermediate, size_t count,
                                  void *environment, Log *log, Update *update) {
    if (strcmp(token, "{clocked}") || !event_mode || !early_return || intermediate || count || !update) return NULL;
    Model *m = calloc(1, sizeof(Model));
    m->log = log, m->update = update, m->environment = environment;
    m->interval = 0.1;
    m->interval_changed = true;
    return m;
}
void fmi3FreeInstance(void *c) { free(c); }
const char *fmi3GetVersion(void) { return "3.0"; }
static int go(Model *m, int from, int to, const char *call) {
    if (m->state != from) return refuse(m, call);
    m->state = to;
    return OK;
}
int fmi3EnterConfigurationMode(void *c) { return refuse(c, "nothing is structural"); }
int fmi3ExitConfigurationMode(void *c) { return refuse(c, "nothing is structural"); }
int fmi3EnterInitializationMode(void *c, bool tolerant, double tolerance, double start, bool stops, double stop) {
    ((Model *)c)->time = start;
    return go(c, INSTANTIATED, INITIALIZATION, "initialised twice");
}
int fmi3ExitInitializationMode(void *c) { return go(c, INITIALIZATION, EVENT, "not initialised"); }
int fmi3EnterEventMode(void *c) { return go(c, STEP, EVENT, "event mode comes after step mode"); }
int fmi3EnterStepMode(void *c) { return go(c, EVENT, STEP, "step mode comes after event mode"); }
int fmi3Terminate(void *c) {
    Model *m = c;
    if (m->state != EVENT && m->state != STEP) return refuse(m, "nothing to end");
    m->state = ENDED;
    return OK;
}
int fmi3Reset(void *c) { return ((Model *)c)->state = INSTANTIATED, OK; }
int fmi3SetDebugLogging(void *c, bool on, size_t count, const char *const *categories) { return OK; }

int fmi3UpdateDiscreteStates(void *c, bool *again, bool *terminate, bool *nominals, bool *values, bool *defined, double *next) {
    Model *m = c;
    if (m->state != EVENT) return refuse(m, "updates belong to event mode");
    *nominals = *values = *terminate = false;
    *defined = m->behaviour == DIVIDES;
    *next = m->time < 0.33 ? 0.33 : m->time + 10.0;
    m->updates++;
    m->shown_mode = m->mode;
    if (m->active[RESET]) m->count = 0, m->fuse_lit = true;
    if (m->active[FUSE]) m->burnt++;
    /* A second update after each tick of `sample`. */
    *again = m->behaviour == ENDLESS || m->active[SAMPLE];
    *terminate = m->behaviour == ENDS && m->count == 2;
    /* The alarm ticks in the update after the second sample. */
    bool alarm = m->active[SAMPLE] && m->count == 2;
    memset(m->active, 0, sizeof m->active);
    if (alarm) {
        m->active[ALARM] = true;
        snprintf(m->note, sizeof m->note, "alarm at %.2f", m->time);
    }
    return OK;
}
int fmi3SetClock(void *c, const uint32_t *references, size_t count, const bool *values) {
    Model *m = c;
    if (m->state != EVENT) return refuse(m, "clocks tick in event mode");
    for (size_t i = 0; i < count; i++) {
        uint32_t clock = references[i];
        if (clock != SAMPLE && clock != RESET && clock != SLOWER && clock != FUSE) return refuse(m, "no such input clock");
        m->active[clock] = values[i];
        if (clock == SAMPLE) m->count++;
        if (clock == SLOWER) m->slow_ticks++, m->interval *= 2.0, m->interval_changed = true;
    }
    return OK;
}
int fmi3GetClock(void *c, const uint32_t *references, size_t count, bool *values) {
    Model *m = c;
    if (m->state != EVENT) return refuse(m, "clocks are read in event mode");
    for (size_t i = 0; i < count; i++) {
        if (references[i] != ALARM) return refuse(m, "no such output clock");
        values[i] = m->active[ALARM];
    }
    return OK;
}
int fmi3GetIntervalDecimal(void *c, const uint32_t *references, size_t count, double *intervals, int *qualifiers) {
    Model *m = c;
    if (m->state != EVENT) return refuse(m, "intervals are read in event mode");
    for (size_t i = 0; i < count; i++) switch (references[i]) {
        case SLOWER: intervals[i] = m->interval, qualifiers[i] = m->interval_changed ? 2 : 1, m->interval_changed = false; break;
        case FUSE: intervals[i] = 0.15, qualifiers[i] = m->fuse_lit ? 2 : 0, m->fuse_lit = false; break;
        default: return refuse(m, "no such interval");
        }
    return OK;
}
int fmi3GetShiftDecimal(void *c, const uint32_t *references, size_t count, double *shifts) { return refuse(c, "no such shift"); }

int fmi3DoStep(void *c, double time, double step, bool no_way_back, bool *event, bool *terminate, bool *early, double *reached) {
    Model *m = c;
    if (m->state != STEP) return refuse(m, "steps belong to step mode");
    if (fabs(time - m->time) > 1e-9) return refuse(m, "the step begins elsewhere");
    *event = *terminate = *early = false;
    bool requested = true;
    double at = -1.0;
    m->update(m->environment, time + step / 2, false, true, false, true, &requested, &at);
    if (requested) return refuse(m, "nobody wants to return early");
    bool half = m->behaviour == EARLY && step > 0.04;
    if (m->behaviour == STUCK) step = 0.0, *early = true;
    if (half) step /= 2, *early = true;
    *reached = m->time = time + step;
    m->update(m->environment, m->time, false, true, true, false, &requested, &at);
    return OK;
}

/* Whether a value can be had now. */
static int ticks(Model *m, int clock, bool set) {
    if (m->state < EVENT && set) return OK;
    return m->state == EVENT && m->active[clock] ? OK : refuse(m, "a clocked variable without a tick");
}
int fmi3GetFloat64(void *c, const uint32_t *references, size_t count, double *values, size_t size) {
    Model *m = c;
    for (size_t i = 0; i < count; i++) {
        if (references[i] != SAMPLED) return refuse(m, "no such Float64");
        if (ticks(m, SAMPLE, false)) return ERROR;
        values[i] = m->sampled = m->u;
    }
    return OK;
}
int fmi3SetFloat64(void *c, const uint32_t *references, size_t count, const double *values, size_t size) {
    Model *m = c;
    if (count != 1 || references[0] != U) return refuse(m, "no such Float64");
    if (ticks(m, SAMPLE, true)) return ERROR;
    m->u = values[0];
    return OK;
}
int fmi3GetInt32(void *c, const uint32_t *references, size_t count, int32_t *values, size_t size) {
    Model *m = c;
    for (size_t i = 0; i < count; i++) switch (references[i]) {
        case COUNT: values[i] = m->count; break;
        case SLOW_TICKS: values[i] = m->slow_ticks; break;
        case BURNT: values[i] = m->burnt; break;
        case MODE: values[i] = m->mode; break;
        case SHOWN_MODE: values[i] = m->shown_mode; break;
        case UPDATES: values[i] = m->updates; break;
        case BEHAVIOUR: values[i] = m->behaviour; break;
        default: return refuse(m, "no such Int32");
        }
    return OK;
}
int fmi3SetInt32(void *c, const uint32_t *references, size_t count, const int32_t *values, size_t size) {
    Model *m = c;
    if (count != 1) return refuse(m, "one Int32 at a time");
    if (references[0] == BEHAVIOUR) return m->behaviour = values[0], OK;
    if (references[0] != MODE) return refuse(m, "no such Int32");
    if (m->state == STEP) return refuse(m, "a discrete input is set in event mode");
    m->mode = values[0];
    return OK;
}
int fmi3GetString(void *c, const uint32_t *references, size_t count, const char **values, size_t size) {
    Model *m = c;
    if (count != 1 || references[0] != NOTE) return refuse(m, "no such String");
    if (ticks(m, ALARM, false)) return ERROR;
    values[0] = m->note;
    return OK;
}
int fmi3SetString(void *c, const uint32_t *r, size_t n, const char *const *v, size_t s) { return refuse(c, "no such String"); }
int fmi3GetBinary(void *c, const uint32_t *r, size_t n, size_t *z, const uint8_t **v, size_t s) { return refuse(c, "no Binary"); }
int fmi3SetBinary(void *c, const uint32_t *r, size_t n, const size_t *z, const uint8_t *const *v, size_t s) {
    return refuse(c, "no Binary");
}

#define ABSENT(TYPE, NAME)                                                                                             \
    int fmi3Get##NAME(void *c, const uint32_t *r, size_t n, TYPE *v, size_t s) { return refuse(c, "no " #NAME); }       \
    int fmi3Set##NAME(void *c, const uint32_t *r, size_t n, const TYPE *v, size_t s) { return refuse(c, "no " #NAME); }
ABSENT(float, Float32)
ABSENT(int8_t, Int8)
ABSENT(uint8_t, UInt8)
ABSENT(int16_t, Int16)
ABSENT(uint16_t, UInt16)
ABSENT(uint32_t, UInt32)
ABSENT(int64_t, Int64)
ABSENT(uint64_t, UInt64)
ABSENT(bool, Boolean)

/* A state is a copy of the model; the addresses in it are those of the instance that gets it back. */
int fmi3GetFMUState(void *c, void **state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return OK;
}
int fmi3SetFMUState(void *c, void *state) {
    Model own = *(Model *)c, *m = c;
    *m = *(Model *)state;
    m->log = own.log, m->update = own.update, m->environment = own.environment;
    return OK;
}
int fmi3FreeFMUState(void *c, void **state) {
    if (state) free(*state), *state = NULL;
    return OK;
}
int fmi3SerializedFMUStateSize(void *c, void *state, size_t *size) { return *size = sizeof(Model), OK; }
int fmi3SerializeFMUState(void *c, void *state, uint8_t *bytes, size_t size) {
    if (size != sizeof(Model)) return refuse(c, "another size");
    memcpy(bytes, state, size);
    return OK;
}
int fmi3DeserializeFMUState(void *c, const uint8_t *bytes, size_t size, void **state) {
    if (size != sizeof(Model)) return refuse(c, "another size");
    *state = malloc(size);
    memcpy(*state, bytes, size);
    return OK;
}
