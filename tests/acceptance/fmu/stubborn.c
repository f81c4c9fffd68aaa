/* Does what foreign FMUs were seen to do: it forgets what comes too early, keeps nothing that it does not like, insists on the stop
   time and on equal steps, logs with its component for an environment, and ends the run itself. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

enum { INSTANTIATED, SET_UP, INITIALIZATION, RUNNING };

typedef struct {
    const Callbacks *callbacks;
    char name[64];
    int state, ended;
    double time, stop, step, tolerance;
    /* By value reference: y, tolerance, early, late, fixed, end, u. */
    double value[7];
} Model;

enum { Y, TOLERANCE, EARLY, LATE, FIXED, END, U };

static void say(Model *m, int status, const char *text) {
    m->callbacks->logger(m, m->name, status, "logAll", "%s", text);
}
static int refuse(Model *m, const char *text) {
    say(m, ERROR, text);
    return ERROR;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    strncpy(m->name, name, sizeof m->name - 1);
    m->value[EARLY] = m->value[LATE] = m->value[FIXED] = 1.0;
    m->value[END] = 1e9;
    return m;
}
void fmi2FreeInstance(void *c) {
    Model *m = c;
    m->callbacks->release(m);
}
int fmi2SetupExperiment(void *c, int with, double tolerance, double start, int ends, double stop) {
    Model *m = c;
    m->value[EARLY] = 1.0;
    m->value[TOLERANCE] = with ? tolerance : -1.0;
    m->time = start;
    m->stop = stop;
    m->state = SET_UP;
    say(m, OK, "ready");
    return OK;
}
int fmi2EnterInitializationMode(void *c) {
    Model *m = c;
    m->value[LATE] = 1.0;
    m->state = INITIALIZATION;
    return OK;
}
int fmi2ExitInitializationMode(void *c) {
    Model *m = c;
    m->state = RUNNING;
    return OK;
}
int fmi2Terminate(void *c) { return OK; }
int fmi2Reset(void *c) { return ERROR; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    if (m->step != 0.0 && step != m->step) return refuse(m, "the step has changed");
    m->step = step;
    if (time + step > m->stop) return refuse(m, "the step passes the stop time");
    m->time = time + step;
    m->ended = m->time >= m->value[END];
    if (m->ended) m->time = m->value[END];
    m->value[Y] = m->time + m->value[U];
    return m->ended ? DISCARD : OK;
}
int fmi2CancelStep(void *c) { return ERROR; }
int fmi2GetRealStatus(void *c, int kind, double *value) {
    *value = ((Model *)c)->time;
    return OK;
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    *value = ((Model *)c)->ended;
    return OK;
}

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->value[reference[i]];
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        if (reference[i] == U && m->state < INITIALIZATION)
            return refuse(m, "an input is set before the initialization");
        if (reference[i] != FIXED) m->value[reference[i]] = value[i];
    }
    return OK;
}

int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    return ERROR;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    return ERROR;
}
