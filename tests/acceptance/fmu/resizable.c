/* An FMU of FMI 3.0 with arrays of the size of a structural parameter n (from 0 to 8): y = gain * u and total = sum(u) by element, a
   text and bytes for each element, and ends of steps as a parameter asks for them. It insists on the order of the calls. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OK, WARNING, DISCARD, ERROR, FATAL };
enum { MOST = 8 };
enum { N, GAIN, U, Y, TOTAL, WORDS, ECHOES, DATA, LENGTHS, END, TOLERANCE };
/* What `end` asks for. */
enum { GOES_ON, TERMINATES, DISCARDS, IS_EARLY };
enum { INSTANTIATED, CONFIGURATION, INITIALIZATION, RUNNING, ENDED };

typedef void Log(void *environment, int status, const char *category, const char *message);

typedef struct {
    int state;
    size_t n;
    double tolerance, gain[MOST], u[MOST];
    float total;
    char words[MOST][64];
    uint8_t data[MOST][64];
    size_t lengths[MOST];
    int32_t end;
} Values;
typedef struct {
    Log *log;
    void *environment;
    Values now;
} Model;

static int refuse(Model *m, const char *what) {
    m->log(m->environment, ERROR, "logStatusError", what);
    return ERROR;
}
/* Whether the arrays of a call have the size of a variable. */
static int fits(Model *m, size_t found, size_t size) {
    char text[64];
    if (found == size) return OK;
    snprintf(text, sizeof text, "expected %zu values, found %zu", size, found);
    return refuse(m, text);
}

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                  bool event_mode, bool early_return, const uint32_t *intermediate, size_t count,
                                  void *environment, Log *log, void *update) {
    if (strcmp(token, "{resizable}") || resources || event_mode || early_return || count || !update) return NULL;
    Model *m = calloc(1, sizeof(Model));
    m->log = log;
    m->environment = environment;
    m->now.n = 2;
    for (int i = 0; i < MOST; i++) m->now.gain[i] = 1.0;
    return m;
}
void fmi3FreeInstance(void *c) { free(c); }
const char *fmi3GetVersion(void) { return "3.0"; }

static int go(Model *m, int from, int to, const char *call) {
    if (m->now.state != from) return refuse(m, call);
    m->now.state = to;
    return OK;
}
int fmi3EnterConfigurationMode(void *c) { return go(c, INSTANTIATED, CONFIGURATION, "configuration comes first"); }
int fmi3ExitConfigurationMode(void *c) { return go(c, CONFIGURATION, INSTANTIATED, "no configuration"); }
int fmi3EnterInitializationMode(void *c, bool tolerant, double tolerance, double start, bool stops, double stop) {
    Model *m = c;
    m->now.tolerance = tolerant ? tolerance : -1.0;
    return go(m, INSTANTIATED, INITIALIZATION, "initialised twice");
}
int fmi3ExitInitializationMode(void *c) { return go(c, INITIALIZATION, RUNNING, "not initialised"); }
int fmi3Terminate(void *c) { return go(c, RUNNING, ENDED, "nothing to end"); }
int fmi3Reset(void *c) {
    ((Model *)c)->now.state = INSTANTIATED;
    return OK;
}
int fmi3SetDebugLogging(void *c, bool on, size_t count, const char *const *categories) { return OK; }

int fmi3DoStep(void *c, double time, double step, bool no_way_back, bool *event, bool *terminate, bool *early, double *reached) {
    Model *m = c;
    *event = *terminate = *early = false;
    *reached = time + step;
#if defined WIDE
    /* As if a boolean of FMI 3.0 were one of FMI 2.0. */
    if (time > 0.15) *(int *)early = false;
#endif
    if (m->now.state != RUNNING) return refuse(m, "no step before the initialisation");
    m->now.total = 0.0f;
    for (size_t i = 0; i < m->now.n; i++) m->now.total += (float)m->now.u[i];
    if (time < 0.15) return OK;
    switch (m->now.end) {
    case TERMINATES: *terminate = true; return OK;
    case DISCARDS: *reached = time + step / 2; return DISCARD;
    case IS_EARLY: *early = true; *reached = time + step / 2; return OK;
    default: return OK;
    }
}

int fmi3GetFloat64(void *c, const uint32_t *references, size_t count, double *values, size_t size) {
    Model *m = c;
    size_t place = 0;
    for (size_t i = 0; i < count; i++) switch (references[i]) {
        case GAIN: case U: case Y:
            for (size_t k = 0; k < m->now.n; k++, place++) {
                double gain = m->now.gain[k], u = m->now.u[k];
                values[place] = references[i] == GAIN ? gain : references[i] == U ? u : gain * u;
            }
            break;
        case TOLERANCE: values[place++] = m->now.tolerance; break;
        default: return refuse(m, "no such Float64");
        }
    return fits(m, size, place);
}
int fmi3SetFloat64(void *c, const uint32_t *references, size_t count, const double *values, size_t size) {
    Model *m = c;
    size_t place = 0;
    for (size_t i = 0; i < count; i++) switch (references[i]) {
        case GAIN: case U: {
            if (fits(m, size - place < m->now.n ? size : place + m->now.n, place + m->now.n)) return ERROR;
            double *into = references[i] == GAIN ? m->now.gain : m->now.u;
            if (references[i] == GAIN && m->now.state > INITIALIZATION) return refuse(m, "gain is fixed");
            for (size_t k = 0; k < m->now.n; k++) into[k] = values[place++];
            break;
        }
        default: return refuse(m, "no such Float64");
        }
    return fits(m, size, place);
}
int fmi3SetUInt64(void *c, const uint32_t *references, size_t count, const uint64_t *values, size_t size) {
    Model *m = c;
    if (m->now.state != CONFIGURATION) return refuse(m, "n is structural: it needs configuration mode");
    if (count != 1 || size != 1 || references[0] != N || values[0] > MOST) return refuse(m, "n is at most 8");
    m->now.n = values[0];
    return OK;
}
int fmi3GetUInt64(void *c, const uint32_t *references, size_t count, uint64_t *values, size_t size) {
    Model *m = c;
    if (count != 1 || references[0] != LENGTHS) return refuse(m, "no such UInt64");
    /* The last one is the largest integer of all. */
    for (size_t k = 0; k < m->now.n; k++) values[k] = m->now.lengths[k] == 63 ? UINT64_MAX : m->now.lengths[k];
    return fits(m, size, m->now.n);
}
int fmi3GetFloat32(void *c, const uint32_t *references, size_t count, float *values, size_t size) {
    values[0] = ((Model *)c)->now.total;
    return count == 1 && references[0] == TOTAL ? fits(c, size, 1) : refuse(c, "no such Float32");
}
int fmi3SetInt32(void *c, const uint32_t *references, size_t count, const int32_t *values, size_t size) {
    ((Model *)c)->now.end = values[0];
    return count == 1 && references[0] == END ? fits(c, size, 1) : refuse(c, "no such Int32");
}
int fmi3GetInt32(void *c, const uint32_t *references, size_t count, int32_t *values, size_t size) {
    values[0] = ((Model *)c)->now.end;
    return count == 1 && references[0] == END ? fits(c, size, 1) : refuse(c, "no such Int32");
}
int fmi3GetString(void *c, const uint32_t *references, size_t count, const char **values, size_t size) {
    Model *m = c;
    if (count != 1 || (references[0] != WORDS && references[0] != ECHOES)) return refuse(m, "no such String");
    for (size_t k = 0; k < m->now.n; k++) values[k] = m->now.words[k];
    return fits(m, size, m->now.n);
}
int fmi3SetString(void *c, const uint32_t *references, size_t count, const char *const *values, size_t size) {
    Model *m = c;
    if (count != 1 || references[0] != WORDS || fits(m, size, m->now.n)) return refuse(m, "no such String");
    for (size_t k = 0; k < size; k++) snprintf(m->now.words[k], sizeof m->now.words[k], "%s", values[k]);
    return OK;
}
int fmi3GetBinary(void *c, const uint32_t *references, size_t count, size_t *sizes, const uint8_t **values, size_t size) {
    Model *m = c;
    if (count != 1 || references[0] != DATA) return refuse(m, "no such Binary");
    for (size_t k = 0; k < m->now.n; k++) sizes[k] = m->now.lengths[k], values[k] = m->now.data[k];
    return fits(m, size, m->now.n);
}
int fmi3SetBinary(void *c, const uint32_t *references, size_t count, const size_t *sizes, const uint8_t *const *values, size_t size) {
    Model *m = c;
    if (count != 1 || references[0] != DATA || fits(m, size, m->now.n)) return refuse(m, "no such Binary");
    for (size_t k = 0; k < size; k++) {
        if (sizes[k] > sizeof m->now.data[k]) return refuse(m, "too many bytes");
        memcpy(m->now.data[k], values[k], sizes[k]);
        m->now.lengths[k] = sizes[k];
    }
    return OK;
}

#define ABSENT(TYPE, NAME)                                                                                             \
    int fmi3Get##NAME(void *c, const uint32_t *r, size_t n, TYPE *v, size_t s) { return refuse(c, "no " #NAME); }       \
    int fmi3Set##NAME(void *c, const uint32_t *r, size_t n, const TYPE *v, size_t s) { return refuse(c, "no " #NAME); }
ABSENT(int8_t, Int8)
ABSENT(uint8_t, UInt8)
ABSENT(int16_t, Int16)
ABSENT(uint16_t, UInt16)
ABSENT(uint32_t, UInt32)
ABSENT(int64_t, Int64)
ABSENT(bool, Boolean)
int fmi3SetFloat32(void *c, const uint32_t *r, size_t n, const float *v, size_t s) { return refuse(c, "no such Float32"); }

int fmi3GetFMUState(void *c, void **state) {
    if (!*state) *state = malloc(sizeof(Values));
    memcpy(*state, &((Model *)c)->now, sizeof(Values));
    return OK;
}
int fmi3SetFMUState(void *c, void *state) {
    memcpy(&((Model *)c)->now, state, sizeof(Values));
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
    return OK;
}
