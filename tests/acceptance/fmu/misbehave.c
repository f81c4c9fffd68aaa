/* Does what FMI 2.0 asks for, until the function named by the parameter `fault` goes wrong at the time `at`. */
#define _GNU_SOURCE
#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <threads.h>
#include <unistd.h>
#if defined __x86_64__
#include <xmmintrin.h>
#endif

#include "fmi2.h"

typedef struct {
    const Callbacks *callbacks;
    char name[64], fault[64];
    double time, at;
    int status, terminated, fatal, failed, started, ready;
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

static void crash(void) {
    volatile int *nowhere = NULL;
    *nowhere = 0;
}
#if defined AT_LOAD
__attribute__((constructor)) static void at_load(void) { AT_LOAD; }
#endif
#if defined AT_UNLOAD
__attribute__((destructor)) static void at_unload(void) { AT_UNLOAD; }
#endif
static int overflow(volatile int depth) {
    volatile char frame[4096];
    frame[0] = (char)depth;
    return depth < 0 ? 0 : overflow(depth + 1) + frame[0];
}
static void *exit_on_a_thread(void *nothing) { exit(0); }
static void *crash_on_a_thread(void *nothing) { return crash(), nothing; }
static void *abort_on_a_thread(void *nothing) { abort(); }
static void *overflow_on_a_thread(void *nothing) { return overflow(0), nothing; }
static void on_a_thread(void *(*what)(void *)) {
    pthread_t thread;
    pthread_create(&thread, NULL, what, NULL);
    pthread_join(thread, NULL);
}
/* One that nobody saw begin. */
static int crash_unseen(void *nothing) { return crash(), 0; }
static void on_an_unseen_thread(void) {
    thrd_t thread;
    thrd_create(&thread, crash_unseen, NULL);
    thrd_join(thread, NULL);
}
/* Writes the number of this process into a file of its folder. */
static void leave_number(const char *name) {
    FILE *file = fopen(name, "w");
    fprintf(file, "%d", getpid());
    fclose(file);
}
/* A process that nobody waits for, with the standard files of this one; in a session of its own, if that is asked for. */
static void start_another(int alone) {
    if (fork() != 0) return;
    if (alone) setsid();
    leave_number("other.pid");
    for (;;) pause();
}

/* A process that ends by this, and is waited for. */
static void child(void (*end)(void)) {
    pid_t number = fork();
    if (number == 0) end();
    waitpid(number, NULL, 0);
}
static void by_exit(void) { exit(0); }
static void by__exit(void) { _exit(0); }

/* Changes what belongs to the whole process, or to its thread. */
static void change(Model *m) {
    if (is(m, "rounds")) fesetround(FE_UPWARD);
#if defined __x86_64__
    if (is(m, "flushes")) _mm_setcsr(_mm_getcsr() | 0x8040);
    if (is(m, "traps by itself")) _mm_setcsr(_mm_getcsr() & ~0x200u);
#endif
    if (is(m, "traps")) feenableexcept(FE_DIVBYZERO);
    if (is(m, "sets the locale")) setlocale(LC_ALL, "C.UTF-8");
    if (is(m, "uses a locale")) uselocale(newlocale(LC_ALL_MASK, "C.UTF-8", NULL));
    if (is(m, "goes away")) {
        umask(0777);
        if (chdir("/") != 0) abort();
    }
}
static void wander(void) {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, NULL);
    signal(SIGSEGV, SIG_DFL);
    umask(0);
    if (chdir("/") != 0) abort();
}

#if defined MEETING
/* Steps only while the other of `one` and `other` steps, too: each leaves a file in this folder for each step, and waits for that of the other. */
static void meet(const Model *m) {
    static int steps;
    char path[2][256];
    for (int i = 0; i < 2; i++) snprintf(path[i], sizeof path[i], "%s/%s-%d", MEETING, i ? "other" : "one", steps);
    FILE *file = fopen(path[strcmp(m->name, "other") == 0], "w");
    if (file == NULL) abort();
    fclose(file);
    for (int i = 0; i < 2; i++)
        while (access(path[i], F_OK) != 0) usleep(100);
    steps++;
}
#endif

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    if (strcmp(guid, "{misbehave}") != 0 || strcmp(name, "refused") == 0) {
        callbacks->logger(callbacks->environment, name, ERROR, "logStatusError",
                          "%s is not welcome", name);
        return NULL;
    }
    if (strcmp(name, "wanderer") == 0) wander();
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
int fmi2ExitInitializationMode(void *m) {
    ((Model *)m)->ready = 1;
    return call(m, "fmi2ExitInitializationMode");
}
int fmi2Terminate(void *m) { return call(m, "fmi2Terminate"); }
int fmi2Reset(void *m) { return call(m, "fmi2Reset"); }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->time = time;
    if (is(m, "escapes")) {
        m->callbacks->logger(m->callbacks->environment, m->name, ERROR, "logStatusError",
                             "\033[2Jgone \302\23331m \342\200\256");
        return ERROR;
    }
    if (is(m, "crash")) crash();
    if (is(m, "abort")) abort();
    if (is(m, "exit")) exit(0);
    if (is(m, "quick_exit")) quick_exit(0);
    if (is(m, "_exit")) _exit(0);
    if (is(m, "_Exit")) _Exit(0);
    if (is(m, "pthread_exit")) pthread_exit(NULL);
    if (is(m, "overflow")) overflow(0);
    if (is(m, "exit on a thread")) on_a_thread(exit_on_a_thread);
    if (is(m, "crash on a thread")) on_a_thread(crash_on_a_thread);
    if (is(m, "abort on a thread")) on_a_thread(abort_on_a_thread);
    if (is(m, "overflow on a thread")) on_a_thread(overflow_on_a_thread);
    if (is(m, "crash on an unseen thread")) on_an_unseen_thread();
    if (is(m, "child exits")) child(by_exit);
    if (is(m, "child _exits")) child(by__exit);
    if (is(m, "child aborts")) child(abort);
    if (is(m, "child crashes")) child(crash);
    if (is(m, "another process") && !m->started++) start_another(0);
    if (is(m, "another session") && !m->started++) start_another(1);
    if (is(m, "another session and sleep") && !m->started++) start_another(1);
#if defined MEETING
    meet(m);
#endif
    change(m);
    if (is(m, "sleep") || is(m, "another session and sleep")) {
        leave_number("sleeping.pid");
        for (;;) pause();
    }
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
    if (is(m, "writes past the end")) value[n] = m->time;
    if (is(m, "shows nothing before the first step") && !m->ready) {
        m->failed = 1;
        return ERROR;
    }
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
    if (n > 0) value[0] = is(c, "dangling text") ? (const char *)8 : ((Model *)c)->fault;
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
