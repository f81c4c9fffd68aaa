/* Shows what it is given, of every type: each output is the input of the same name. As the head of a chain, when its
   `gear` is reverse, it counts its steps instead, in every type. */
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "fmi2.h"

/* Another version of the FMU is compiled with another value: what each step adds to the shown number. */
#ifndef DRIFT
#define DRIFT 0.0
#endif

typedef struct {
    const Callbacks *callbacks;
    double x;
    int integers[3]; /* n, mode, gear */
    int on, steps;
    char text[256];
} Model;

enum { N, MODE, GEAR };

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    m->integers[MODE] = m->integers[GEAR] = 1;
    return m;
}
void fmi2FreeInstance(void *c) { ((Model *)c)->callbacks->release(c); }
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) {
    return OK;
}
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *m) { return OK; }
int fmi2Terminate(void *m) { return OK; }
int fmi2Reset(void *m) { return OK; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->steps++;
    if (m->integers[GEAR] == -1) {
        static const int modes[] = {1, 2, 4};
        m->x = m->steps / 3.0;
        m->integers[N] = -m->steps;
        m->on = m->steps % 2;
        m->integers[MODE] = modes[m->steps % 3];
        if (m->steps % 5 == 0) m->text[0] = 0;
        else snprintf(m->text, sizeof m->text, "Schritt \"%d\",\n\xc3\xbc; 'x'", m->steps / 2);
    }
    return OK;
}
int fmi2CancelStep(void *m) { return DISCARD; }

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) value[i] = m->x + DRIFT * m->steps;
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    for (size_t i = 0; i < n; i++) ((Model *)c)->x = value[i];
    return OK;
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->integers[reference[i] % 3];
    return OK;
}
/* An item that there is not ends the run here: the master is to find out before. */
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) {
    for (size_t i = 0; i < n; i++) {
        int mode = value[i] == 1 || value[i] == 2 || value[i] == 4;
        int gear = value[i] == 1 || value[i] == -1;
        if ((reference[i] == MODE && !mode) || (reference[i] == GEAR && !gear)) return ERROR;
        ((Model *)c)->integers[reference[i]] = value[i];
    }
    return OK;
}
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->on;
    return OK;
}
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) {
    for (size_t i = 0; i < n; i++) ((Model *)c)->on = value[i];
    return OK;
}
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->text;
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    for (size_t i = 0; i < n; i++)
        snprintf(((Model *)c)->text, sizeof ((Model *)c)->text, "%s", value[i]);
    return OK;
}

