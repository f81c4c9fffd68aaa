/* Logs what the parameter `what` says, with loggingOn and without. Its steps log `count` messages. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

typedef struct {
    const Callbacks *callbacks;
    char name[64], what[64];
    double time;
    int count;
} Model;

static int is(Model *m, const char *what) { return strcmp(m->what, what) == 0; }
static void log_text(Model *m, int status, const char *category, const char *text) {
    m->callbacks->logger(m->callbacks->environment, m->name, status, category, "%s", text);
}
static void log_number(Model *m, const char *format, double number) {
    char text[128];
    snprintf(text, sizeof text, format, number);
    log_text(m, WARNING, "logStatusWarning", text);
}
static void *on_a_thread(void *m) {
    for (int i = 0; i < ((Model *)m)->count; i++) log_number(m, "thread %g", i);
    return NULL;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    Model *m = calloc(1, sizeof(Model));
    m->callbacks = callbacks;
    strncpy(m->name, name, sizeof m->name - 1);
    return m;
}
void fmi2FreeInstance(void *c) {
    Model *m = c;
    if (is(m, "freed")) log_text(m, WARNING, "logStatusWarning", "a file stays open");
    free(m);
}
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) {
    return OK;
}
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *c) {
    Model *m = c;
    if (is(m, "summary")) {
        log_text(m, OK, "summary", "a model that talks");
        log_text(m, OK, "logEvents", "nobody wants this");
    }
    if (!is(m, "initialised")) return OK;
    log_text(m, OK, "logEvents", "the start is odd");
    return WARNING;
}
int fmi2Terminate(void *c) {
    if (is(c, "terminated")) log_text(c, ERROR, "logStatusError", "too late");
    return OK;
}
int fmi2Reset(void *m) { return OK; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->time = time + step;
    if (is(m, "returns")) {
        log_number(m, "steep at %g s", m->time);
        return WARNING;
    }
    if (is(m, "silent")) return WARNING;
    if (is(m, "repeats")) {
        for (int i = 0; i < m->count; i++) log_number(m, "residual %g\n", time + i);
        return OK;
    }
    if (is(m, "kinds")) {
        char format[64];
        for (int i = 0; i < m->count; i++) {
            snprintf(format, sizeof format, "kind%d at %%g s", i);
            log_number(m, format, time);
        }
    }
    if (is(m, "lines")) log_text(m, ERROR, "logStatusError", "first <b>line</b>\nsecond line\r\n");
    if (is(m, "bytes")) log_text(m, WARNING, "logStatusWarning", "Gr\xf6\xdf" "e \xc3\xa4 \033[2J");
    if (is(m, "long")) {
        char *text = malloc(1000001);
        memset(text, 'x', 1000000);
        text[1000000] = '\0';
        log_text(m, WARNING, "logStatusWarning", text);
        free(text);
    }
    if (is(m, "threads")) {
        pthread_t threads[4];
        for (int i = 0; i < 4; i++) pthread_create(&threads[i], NULL, on_a_thread, m);
        for (int i = 0; i < 4; i++) pthread_join(threads[i], NULL);
    }
    return OK;
}

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->time;
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) { return OK; }
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->count;
    return OK;
}
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) {
    if (n > 0) ((Model *)c)->count = value[n - 1];
    return OK;
}
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->what;
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    if (n > 0) strncpy(((Model *)c)->what, value[n - 1], sizeof ((Model *)c)->what - 1);
    return OK;
}
