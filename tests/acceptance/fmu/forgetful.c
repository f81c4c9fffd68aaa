/* Adds up what it gets, and counts its steps. With -DFORGETS the count is no part of its state, though it shows it: all instances in a
   process share it. */
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

typedef struct {
    double u, sum, gain, count, at;
} Model;

#ifdef FORGETS
static double steps;
#define COUNT(m) steps
#else
#define COUNT(m) ((m)->count)
#endif

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    Model *m = calloc(1, sizeof(Model));
    m->gain = 1;
    m->at = -1;
    return m;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) {
    return OK;
}
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *m) { return OK; }
int fmi2Terminate(void *m) { return OK; }
int fmi2Reset(void *m) { return OK; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    if (m->at >= 0 && time >= m->at) abort();
    m->sum += m->gain * m->u * step;
    COUNT(m) += 1;
    return OK;
}
int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        const double all[] = {m->u, m->sum, COUNT(m), m->gain, m->at};
        value[i] = all[reference[i] % 5];
    }
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        double *all[] = {&m->u, NULL, NULL, &m->gain, &m->at};
        if (!all[reference[i] % 5]) return ERROR;
        *all[reference[i] % 5] = value[i];
    }
    return OK;
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) { return ERROR; }
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    return ERROR;
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
    if (state) free(*state), *state = NULL;
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
    if (size != sizeof(Model)) return ERROR;
    *state = malloc(size);
    memcpy(*state, bytes, size);
    return OK;
}
