/* Does in its steps, from the time `at` on, what the parameter `how` says; the output `y` says whether it could, `steps` counts its steps. */
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <unistd.h>

#include "fmi2.h"

typedef struct {
    const Callbacks *callbacks;
    char how[64], path[512];
    double at, y, u;
    int steps;
} Model;

static int opens(const char *path, int flags) {
    int file = open(path, flags, 0600);
    if (file >= 0) close(file);
    return file >= 0;
}
static volatile int depth;
static int deeper(int n) {
    volatile char frame[4096];
    frame[n % 4096] = (char)n;
    depth = n;
    return depth < 0 ? 0 : deeper(n + 1) + frame[n % 4096];
}
static int is(const Model *m, const char *how) { return strcmp(m->how, how) == 0; }

static double trespass(Model *m) {
    if (is(m, "network")) return socket(AF_INET, SOCK_STREAM, 0) >= 0;
    if (is(m, "read")) return opens(m->path, O_RDONLY);
    if (is(m, "write")) return opens(m->path, O_WRONLY | O_CREAT);
    if (is(m, "scratch")) return opens("left.txt", O_WRONLY | O_CREAT);
    if (is(m, "signal")) return kill(getppid(), 0) == 0;
    if (is(m, "trace")) return ptrace(PTRACE_ATTACH, getppid(), NULL, NULL) == 0;
    if (is(m, "descriptors"))
        for (int file = 0; file < 256; file++) close(file);
    if (is(m, "stack")) return deeper(0);
    if (is(m, "kill")) raise(SIGKILL);
    if (is(m, "stop")) raise(SIGSTOP);
    if (is(m, "once") && !opens("been here", O_RDONLY)) {
        opens("been here", O_WRONLY | O_CREAT);
        abort();
    }
    return 1;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    return m;
}
void fmi2FreeInstance(void *c) { ((Model *)c)->callbacks->release(c); }
int fmi2SetupExperiment(void *m, int with, double tolerance, double start, int ends, double stop) { return OK; }
int fmi2EnterInitializationMode(void *m) { return OK; }
int fmi2ExitInitializationMode(void *m) { return OK; }
int fmi2Terminate(void *m) { return OK; }
int fmi2Reset(void *m) { return OK; }
int fmi2CancelStep(void *m) { return DISCARD; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    m->steps++;
    if (time >= m->at) m->y = trespass(m);
    return OK;
}
int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    const Model *m = c;
    const double values[] = {m->y, m->at, m->u, m->steps};
    for (size_t i = 0; i < n; i++) value[i] = values[reference[i]];
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++)
        if (reference[i] == 1) m->at = value[i];
        else m->u = value[i];
    return OK;
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) { return OK; }
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) { return OK; }
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) { return OK; }
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) { return OK; }
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) value[i] = reference[i] == 0 ? m->how : m->path;
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    Model *m = c;
    for (size_t i = 0; i < n; i++)
        if (reference[i] == 0) strncpy(m->how, value[i], sizeof m->how - 1);
        else strncpy(m->path, value[i], sizeof m->path - 1);
    return OK;
}
int fmi2GetRealStatus(void *c, int kind, double *value) { return DISCARD; }
int fmi2GetBooleanStatus(void *c, int kind, int *value) { return DISCARD; }
