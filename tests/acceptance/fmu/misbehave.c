/* Does what FMI 2.0 asks for, until the function named by the parameter `fault` goes wrong at the time `at`. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <signal.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2.h"

typedef struct {
    const Callbacks *callbacks;
    char name[64], fault[64];
    double time, at;
    int status, terminated, fatal, failed, started;
} Model;

/* After an error nothing but freeing is allowed, after a fatal one not even that: whoever calls dies. */
static int call(Model *m, const char *function) {
    if (m->failed) abort();
    if (strcmp(m->fault, function) != 0 || m->time < m->at) return OK;
    m->callbacks->logger(m->callbacks->environment, m->name, m->status, "logStatusError",
                         "%s: the %s is %d %% full at %.2f s", function, "tank", 42, m->time);
    m->failed = m->status >= ERROR;
    m->fatal = m->status == FATAL;
    return m->status;
}
static int is(Model *m, const char *fault) {
    return strcmp(m->fault, fault) == 0 && m->time >= m->at;
}

#if defined AT_LOAD
__attribute__((constructor)) static void at_load(void) { AT_LOAD; }
#endif
#if defined AT_UNLOAD
__attribute__((destructor)) static void at_unload(void) { AT_UNLOAD; }
#endif

static void *exit_on_a_thread(void *nothing) {
    exit(0);
    return nothing;
}
/* Writes the number of this process into a file of its folder. */
static void leave_number(const char *name) {
    FILE *file = fopen(name, "w");
    fprintf(file, "%d", getpid());
    fclose(file);
}
/* A process that nobody waits for, with the standard files of this one. */
static void start_another(void) {
    if (fork() != 0) return;
    leave_number("other.pid");
    for (;;) pause();
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    if (strcmp(guid, "{misbehave}") != 0 || strcmp(name, "refused") == 0) {
        callbacks->logger(callbacks->environment, name, ERROR, "logStatusError",
                          "%s is not welcome", name);
        return NULL;
    }
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    strncpy(m->name, name, sizeof m->name - 1);
    return m;
}
void fmi2FreeInstance(void *c) {
    Model *m = c;
    if (m->fatal || is(m, "abort when freed")) abort();
    if (is(m, "exit when freed")) exit(0);
    while (is(m, "sleep when freed")) pause();
    m->callbacks->release(m);
}
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) {
    return strcmp(((Model *)m)->name, "unwilling") == 0 ? ERROR : OK;
}
int fmi2EnterInitializationMode(void *m) { return call(m, "fmi2EnterInitializationMode"); }
int fmi2ExitInitializationMode(void *m) { return call(m, "fmi2ExitInitializationMode"); }
int fmi2Terminate(void *m) { return call(m, "fmi2Terminate"); }
int fmi2Reset(void *m) { return call(m, "fmi2Reset"); }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->time = time;
    if (is(m, "crash")) {
        volatile int *nowhere = NULL;
        *nowhere = 0;
    }
    if (is(m, "abort")) abort();
    if (is(m, "exit")) exit(0);
    if (is(m, "quick_exit")) quick_exit(0);
    if (is(m, "_exit")) _exit(0);
    if (is(m, "pthread_exit")) pthread_exit(NULL);
    if (is(m, "exit on a thread")) {
        pthread_t thread;
        pthread_create(&thread, NULL, exit_on_a_thread, NULL);
        pthread_join(thread, NULL);
    }
    if (is(m, "another process") && !m->started++) start_another();
    if (is(m, "sleep")) leave_number("sleeping.pid");
    while (is(m, "sleep")) pause();
#if defined ONE_STEP
    if (step != ONE_STEP) return ERROR;
#endif
    int status = call(m, "fmi2DoStep");
    if (status <= WARNING) m->time = time + step;
    return status;
}
int fmi2CancelStep(void *m) { return DISCARD; }

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++)
        value[i] = reference[i] == 1 ? m->at : is(m, "nan") ? NAN : is(m, "infinity") ? INFINITY : m->time;
    return call(m, "fmi2GetReal");
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    for (size_t i = 0; i < n; i++)
        if (reference[i] == 1) ((Model *)c)->at = value[i];
    return call(c, "fmi2SetReal");
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) {
    if (n > 0) value[0] = ((Model *)c)->status;
    return OK;
}
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) {
    if (n > 0) ((Model *)c)->status = value[n - 1];
    return OK;
}
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) {
    if (n > 0) value[0] = ((Model *)c)->terminated;
    return OK;
}
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) {
    if (n > 0) ((Model *)c)->terminated = value[n - 1];
    return OK;
}
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    if (n > 0) value[0] = ((Model *)c)->fault;
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    if (n > 0) strncpy(((Model *)c)->fault, value[n - 1], sizeof ((Model *)c)->fault - 1);
    return OK;
}

int fmi2GetRealStatus(void *c, int kind, double *value) {
    *value = ((Model *)c)->time;
    return OK;
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    *value = ((Model *)c)->terminated;
    return OK;
}
