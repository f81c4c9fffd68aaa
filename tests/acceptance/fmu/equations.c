/* Equations for an integrator, by `kind`: Robertson's reaction; a switch without hysteresis; a derivative that is no number after 0.35 s;
   and `driven`: x_1 counts the discrete input n over time, x_2 integrates the input u, x_3 jumps by events of all kinds. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

enum { ROBERTSON = 1, SWITCH, BROKEN, DRIVEN };
enum { EVENT, CONTINUOUS };

typedef struct {
    double t, x[3], u, next, sign;
    int kind, n, evaluations, events, mode, stepped;
} Model;

typedef struct {
    int again, terminate, nominals, values, next_defined;
    double next;
} EventInfo;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    if (type != 0) return NULL;
    Model *m = calloc(1, sizeof(Model));
    m->x[0] = m->sign = m->kind = 1;
    m->next = 0.5;
    return m;
}
void fmi2FreeInstance(void *m) { free(m); }
int fmi2SetupExperiment(void *c, int with, double tolerance, double start, int ends, double stop) {
    ((Model *)c)->t = start;
    return with ? OK : ERROR;
}
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *m) { return OK; }
int fmi2Terminate(void *m) { return OK; }
int fmi2Reset(void *c) {
    memset(c, 0, sizeof(Model));
    Model *m = c;
    m->x[0] = m->sign = m->kind = 1;
    m->next = 0.5;
    return OK;
}

static void derivatives(Model *m, double *dx) {
    const double *x = m->x;
    dx[0] = dx[1] = dx[2] = 0;
    switch (m->kind) {
    case ROBERTSON:
        dx[0] = -0.04 * x[0] + 1e4 * x[1] * x[2];
        dx[2] = 3e7 * x[1] * x[1];
        dx[1] = -dx[0] - dx[2];
        break;
    case SWITCH: dx[0] = -m->sign; break;
    case BROKEN: dx[1] = m->t < 0.35 ? 1 : NAN; break;
    case DRIVEN: dx[0] = m->n; dx[1] = m->u; break;
    }
}

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    Model *m = c;
    double dx[3];
    derivatives(m, dx);
    for (size_t i = 0; i < n; i++)
        value[i] = reference[i] < 3 ? m->x[reference[i]] : reference[i] < 6 ? dx[reference[i] - 3] : m->u;
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) *(reference[i] < 3 ? &m->x[reference[i]] : &m->u) = value[i];
    return OK;
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) {
    Model *m = c;
    const int values[] = {m->kind, m->n, m->evaluations, m->events};
    for (size_t i = 0; i < n; i++) value[i] = values[reference[i] - 7];
    return OK;
}
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        /* A discrete input changes in event mode only. */
        if (m->mode == CONTINUOUS) return ERROR;
        *(reference[i] == 7 ? &m->kind : &m->n) = value[i];
    }
    return OK;
}
int fmi2GetBoolean(void *m, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetBoolean(void *m, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetString(void *m, const unsigned *reference, size_t n, const char **value) { return ERROR; }
int fmi2SetString(void *m, const unsigned *reference, size_t n, const char *const *value) { return ERROR; }

int fmi2EnterEventMode(void *c) {
    Model *m = c;
    if (m->mode == EVENT) return ERROR;
    m->mode = EVENT;
    m->events++;
    return OK;
}
int fmi2NewDiscreteStates(void *c, EventInfo *info) {
    Model *m = c;
    memset(info, 0, sizeof *info);
    if (m->mode != EVENT) return ERROR;
    if (m->kind == SWITCH) m->sign = m->x[0] > 0 ? 1 : -1;
    if (m->kind == DRIVEN) {
        /* The event of a time takes two updates, and changes a state and its nominal value. */
        if (m->t >= m->next) {
            m->next = m->t == 0.5 ? 0.75 : 1e9;
            m->x[2] += m->t == 0.5 || m->t == 0.75 ? 10 : 1e6;
            info->again = info->values = info->nominals = 1;
        }
        if (m->stepped == 1) {
            m->stepped = 2;
            m->x[2] += 100;
            info->values = 1;
        }
        info->next_defined = 1;
        info->next = m->next;
    }
    return OK;
}
int fmi2EnterContinuousTimeMode(void *c) {
    ((Model *)c)->mode = CONTINUOUS;
    return OK;
}
int fmi2CompletedIntegratorStep(void *c, int no_way_back, int *event, int *terminate) {
    Model *m = c;
    *terminate = 0;
    *event = m->kind == DRIVEN && m->stepped == 0 && m->x[1] > 0.5;
    if (*event) m->stepped = 1;
    return OK;
}
int fmi2SetTime(void *c, double time) {
    ((Model *)c)->t = time;
    return OK;
}
int fmi2SetContinuousStates(void *c, const double *x, size_t n) {
    if (n != 3) return ERROR;
    memcpy(((Model *)c)->x, x, sizeof(double[3]));
    return OK;
}
int fmi2GetContinuousStates(void *c, double *x, size_t n) {
    if (n != 3) return ERROR;
    memcpy(x, ((Model *)c)->x, sizeof(double[3]));
    return OK;
}
int fmi2GetNominalsOfContinuousStates(void *c, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = ((Model *)c)->kind == ROBERTSON && i == 1 ? 1e-4 : 1;
    return OK;
}
int fmi2GetDerivatives(void *c, double *dx, size_t n) {
    ((Model *)c)->evaluations++;
    derivatives(c, dx);
    return n == 3 ? OK : ERROR;
}
int fmi2GetEventIndicators(void *c, double *z, size_t n) {
    Model *m = c;
    /* Without a switch it stays at 0. */
    z[0] = m->kind == SWITCH ? m->x[0] : m->kind == DRIVEN ? m->u - 2 : 0;
    return n == 1 ? OK : ERROR;
}
/* Of Robertson's reaction only; the others have differences. */
int fmi2GetDirectionalDerivative(void *c, const unsigned *unknown, size_t unknowns, const unsigned *known,
                                 size_t knowns, const double *change, double *value) {
    Model *m = c;
    if (m->kind != ROBERTSON) return ERROR;
    const double *x = m->x;
    const double j[3][3] = {{-0.04, 1e4 * x[2], 1e4 * x[1]},
                            {0.04, -1e4 * x[2] - 6e7 * x[1], -1e4 * x[1]},
                            {0, 6e7 * x[1], 0}};
    for (size_t i = 0; i < unknowns; i++) {
        value[i] = 0;
        for (size_t k = 0; k < knowns; k++) value[i] += j[unknown[i] - 3][known[k]] * change[k];
    }
    return OK;
}

int fmi2GetFMUstate(void *c, void **state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return OK;
}
int fmi2SetFMUstate(void *c, void *state) {
    memcpy(c, state, sizeof(Model));
    return OK;
}
int fmi2FreeFMUstate(void *c, void **state) {
    free(*state);
    *state = NULL;
    return OK;
}
int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
    *size = sizeof(Model);
    return OK;
}
int fmi2SerializeFMUstate(void *c, void *state, char *bytes, size_t size) {
    memcpy(bytes, state, sizeof(Model));
    return OK;
}
int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **state) {
    *state = malloc(sizeof(Model));
    memcpy(*state, bytes, sizeof(Model));
    return OK;
}
