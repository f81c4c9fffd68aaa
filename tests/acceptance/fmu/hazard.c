/* Integrates u, logs what it is told to, and from a time on does what ends a process, by `fault`: plain C, for Windows as well. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

typedef struct {
    const Callbacks *callbacks;
    char name[64], fault[64];
    double u, y, at;
} Model;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    m->u = 1;
    snprintf(m->name, sizeof m->name, "%s", name);
    callbacks->logger(callbacks->environment, m->name, WARNING, "start", "resources at %s, %d%% of %.2f", resources, 50, 1.5);
    return m;
}
void fmi2FreeInstance(void *c) {
    Model *m = c;
    m->callbacks->release(m);
}
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) { return OK; }
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *m) { return OK; }
int fmi2Terminate(void *m) { return OK; }
int fmi2Reset(void *m) { return OK; }

static int deep(volatile int *above) {
    volatile int here[4096] = {*above};
    return *above == 0 ? deep(here) + here[1] : 0;
}

static int is(const Model *m, const char *fault) { return strcmp(m->fault, fault) == 0; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->y += m->u * step;
    if (time < m->at - 1e-9) return OK;
    if (is(m, "memory")) *(volatile int *)8 = 1;
    if (is(m, "division")) {
        volatile int zero = 0;
        zero = 7 / zero;
    }
    if (is(m, "stack")) {
        volatile int none = 0;
        deep(&none);
    }
    if (is(m, "exit")) exit(7);
    if (is(m, "abort")) abort();
    while (is(m, "hang")) {}
    if (is(m, "log")) {
        for (int i = 0; i < 20000; i++)
            m->callbacks->logger(m->callbacks->environment, m->name, WARNING, "flood", "message %d of the flood at %g s", i, time);
    }
    if (is(m, "twice")) {
        void *volatile one = malloc(100);
        free(one);
        free(one);
    }
    return is(m, "error") ? ERROR : OK;
}

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) value[i] = reference[i] == 0 ? m->y : reference[i] == 1 ? m->at : m->u;
    if (is(m, "past") && m->y > 0.5) value[n] = 1;
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) *(reference[i] == 1 ? &m->at : &m->u) = value[i];
    return OK;
}
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->fault;
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) snprintf(m->fault, sizeof m->fault, "%s", value[i]);
    return OK;
}
int fmi2GetInteger(void *m, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetInteger(void *m, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetBoolean(void *m, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetBoolean(void *m, const unsigned *reference, size_t n, const int *value) { return ERROR; }
