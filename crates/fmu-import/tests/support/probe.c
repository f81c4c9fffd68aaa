/* An FMU of exponential decay that does what the macro BEHAVIOUR says. An instance that has a path as its name writes each
   call into the file there. */
#include <math.h>
#include <pthread.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "fmi2.h"

#define IS(behaviour) (strcmp(BEHAVIOUR, behaviour) == 0)
#if defined OWN_HANDLER
#include "lazy.c"
#endif

typedef struct {
    double time, y;
} Values;
typedef struct {
    const Callbacks *callbacks;
    char name[256];
    Values now;
    double forgotten;
} Model;

static void write_down(const char *name, const char *call) {
    FILE *file = name[0] == '/' ? fopen(name, "a") : NULL;
    if (!file) return;
    fprintf(file, "%s\n", call);
    fclose(file);
}
static int did(void *c, const char *call) {
    write_down(((Model *)c)->name, call);
    return OK;
}

int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *categories) {
    return did(c, "fmi2SetDebugLogging");
}

static Logger *last_logger;
static void *last_environment;

static void *log_from_a_thread(void *c) {
    Model *m = c;
    m->callbacks->logger(m->callbacks->environment, m->name, WARNING, "thread", "%d threads", 2);
    return NULL;
}
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    write_down(name, "fmi2Instantiate");
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    m->now.y = 1.0;
    m->forgotten = -1.0;
    snprintf(m->name, sizeof m->name, "%s", name);
    if (IS("logs to strangers")) {
        if (last_logger) last_logger(last_environment, name, ERROR, "late", "I am gone");
        callbacks->logger((void *)0xdead, name, ERROR, "odd", "who are you?");
        last_logger = callbacks->logger;
        last_environment = callbacks->environment;
    }
    if (IS("logs from a thread")) {
        pthread_t thread;
        pthread_create(&thread, NULL, log_from_a_thread, m);
        pthread_join(thread, NULL);
    }
    return m;
}
void fmi2FreeInstance(void *c) {
    did(c, "fmi2FreeInstance");
    ((Model *)c)->callbacks->release(c);
}
int fmi2SetupExperiment(void *c, int with, double tolerance, double start, int ends, double stop) {
    ((Model *)c)->now.time = start;
    return did(c, "fmi2SetupExperiment");
}
int fmi2EnterInitializationMode(void *c) { return did(c, "fmi2EnterInitializationMode"); }
int fmi2ExitInitializationMode(void *c) { return did(c, "fmi2ExitInitializationMode"); }
int fmi2Terminate(void *c) { return did(c, "fmi2Terminate"); }
int fmi2Reset(void *c) { return did(c, "fmi2Reset"); }

int fmi2DoStep(void *c, double time, double step, int no_way_back) {
    Model *m = c;
    did(c, no_way_back ? "fmi2DoStep without a way back" : "fmi2DoStep with a way back");
    if (IS("crashes")) *(volatile int *)NULL = 0;
    if (IS("is fatal")) return FATAL;
    if (IS("discards") || IS("terminates")) {
        m->callbacks->logger(m->callbacks->environment, m->name, DISCARD, "", "not so far");
        return DISCARD;
    }
    if (IS("touches memory lazily")) {
        char *page = mmap(NULL, 4096, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        page[7] = 1;
        munmap(page, 4096);
    }
    /* History that nobody needs any more is dropped, as FMI 2.0 allows. */
    if (no_way_back) m->forgotten = time;
    m->now.y *= exp(-step);
    m->now.time = time + step;
    return OK;
}

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->now.y;
    return did(c, "fmi2GetReal");
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) { return ERROR; }
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) {
    for (size_t i = 0; i < n; i++) value[i] = -17;
    return OK;
}
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) { return OK; }
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    if (n > 0) value[0] = reference[0] == 0 ? NULL : "caf\xe9";
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    return did(c, "fmi2SetString");
}

int fmi2GetFMUstate(void *c, void **state) {
    if (*state == NULL) *state = calloc(1, sizeof(Values));
    *(Values *)*state = ((Model *)c)->now;
    return did(c, "fmi2GetFMUstate");
}
int fmi2SetFMUstate(void *c, void *state) {
    Model *m = c;
    did(c, "fmi2SetFMUstate");
    if (((Values *)state)->time <= m->forgotten) return ERROR;
    m->now = *(Values *)state;
    return OK;
}
int fmi2FreeFMUstate(void *c, void **state) {
    free(*state);
    *state = NULL;
    return did(c, "fmi2FreeFMUstate");
}
int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
    *size = IS("has an immense state") ? SIZE_MAX : sizeof(Values);
    return OK;
}
int fmi2SerializeFMUstate(void *c, void *state, char *bytes, size_t size) {
    memcpy(bytes, state, sizeof(Values));
    return OK;
}
int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **state) {
    if (size != sizeof(Values)) return ERROR;
    *state = calloc(1, sizeof(Values));
    memcpy(*state, bytes, sizeof(Values));
    return OK;
}

int fmi2GetRealStatus(void *c, int kind, double *value) {
    *value = 0.25;
    return OK;
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    *value = IS("terminates");
    return OK;
}
