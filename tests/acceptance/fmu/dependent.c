/* Shows what it gets from elsewhere: NEXT is a library beside it, a variable of the whole process, a program among its resources, or a
   thread that never ends. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include "fmi2.h"

typedef struct {
    const Callbacks *callbacks;
    char resources[1024];
    double y;
} Model;

#if defined LIBRARY
double dependent_next(void);
static double next(Model *m) { return dependent_next(); }
#elif defined UNIQUE
/* As g++ makes a static member of a template, or an inline variable. */
double dependent_gain = UNIQUE;
__asm__(".type dependent_gain, @gnu_unique_object");
static double next(Model *m) { return dependent_gain; }
#elif defined CONSTANT
const double dependent_gain = CONSTANT;
__asm__(".type dependent_gain, @gnu_unique_object");
static double next(Model *m) { return *(const volatile double *)&dependent_gain; }
#elif defined TOOL
static double next(Model *m) {
    char command[2048];
    snprintf(command, sizeof command, "'%s/tool.sh'", m->resources);
    return WEXITSTATUS(system(command));
}
#elif defined THREAD
static volatile long rounds;
static void *spin(void *nothing) {
    for (;;) rounds += 1 + usleep(100);
    return nothing;
}
static double next(Model *m) {
    pthread_t thread;
    if (m->y == 0.0) pthread_create(&thread, NULL, spin, NULL);
    return 3.0;
}
#elif defined OPENMP
static double next(Model *m) {
    double sum = 0.0;
#pragma omp parallel for reduction(+ : sum)
    for (int i = 0; i < 300; i++) sum += 0.01;
    return (int)(sum + 0.5);
}
#else
static double next(Model *m) { return 3.0; }
#endif

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const Callbacks *callbacks,
                      int visible, int logging) {
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    if (resources) snprintf(m->resources, sizeof m->resources, "%s", resources + sizeof "file://" - 1);
    return m;
}
void fmi2FreeInstance(void *c) { ((Model *)c)->callbacks->release(c); }
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) { return OK; }
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *m) { return OK; }
int fmi2Terminate(void *m) { return OK; }
int fmi2Reset(void *c) {
    ((Model *)c)->y = 0.0;
    return OK;
}
int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->y = next(m);
    return OK;
}
int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = reference[i] == 0 ? ((Model *)c)->y : 1.0;
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) { return OK; }
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) { return ERROR; }
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) { return ERROR; }
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) { return ERROR; }
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) { return ERROR; }
