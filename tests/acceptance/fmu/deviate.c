/* Keeps the rules of FMI 2.0, but for the one that the macro given to the compiler breaks. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2.h"

#if defined BREAKS
#define IS(deviation) (strcmp(BREAKS, deviation) == 0)
#else
#define IS(deviation) 0
#endif

enum { INSTANTIATED = 1, INITIALIZATION = 2, COMPLETE = 4, TERMINATED = 8, FAILED = 16 };
enum { ALIVE = 31 };

/* What an FMU state holds. */
typedef struct {
    double time, stop, x, u, gain;
    int state, steps, on, set_up;
    char label[32];
} Values;

typedef struct {
    const Callbacks *callbacks;
    char name[64];
    int logging;
    Values now;
    /* No state from before this time can be restored. */
    double forgotten;
} Model;

static double shared;
static int calls;

static void say(Model *m, int status, const char *category, const char *text) {
    const Callbacks *to = m->callbacks;
    if (IS("a category that is not declared")) category = "chatter";
    if (IS("a name as a format")) to->logger(to->environment, m->name, status, category, m->name);
    void *environment =
        IS("the component is the environment of messages") ? (void *)m : to->environment;
    to->logger(environment, m->name, status, category, "%s: %s", m->name, text);
}
static int fail(Model *m, const char *text) {
    m->now.state = FAILED;
    say(m, ERROR, "logStatusError", text);
    return ERROR;
}
static int illegal(Model *m, int allowed) {
    if (m->now.state & allowed || IS("illegal calls are accepted")) return 0;
    return fail(m, "this call is not allowed now");
}
static Values fresh(void) {
    Values values = {.gain = IS("another start value") ? 2.5 : 2.0, .state = INSTANTIATED};
    strcpy(values.label, "tank");
    return values;
}

static void remove_temporary_files(void) {
    if (system("rm -r \"$TMPDIR\"") != 0) abort();
}

const char *fmi2GetVersion(void) { return IS("another version") ? "1.0" : "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *categories) {
    if (n > 0 && IS("a category is refused")) return fail(c, "no such category");
    ((Model *)c)->logging = on;
    return OK;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const Callbacks *callbacks, int visible, int logging) {
    if (strcmp(guid, "{deviate}") != 0 && !IS("any GUID is accepted")) {
        int formats = IS("a GUID as a format");
        callbacks->logger(callbacks->environment, name, ERROR, "logStatusError",
                          formats ? guid : "%s has another GUID than mine", formats ? "" : guid, 0, "", 0, "");
        return NULL;
    }
    Model *m = callbacks->allocate(1, sizeof(Model));
    m->callbacks = callbacks;
    m->logging = logging || IS("logging that nobody wants");
    m->now = fresh();
    strncpy(m->name, name, sizeof m->name - 1);
    m->forgotten = -INFINITY;
    if (IS("the temporary files vanish")) remove_temporary_files();
    if (IS("a kilobyte is lost")) memset(malloc(1024), 1, 1024);
    if (m->logging) say(m, OK, "logAll", "here I am");
    return m;
}
void fmi2FreeInstance(void *c) {
    Model *m = c;
    m->callbacks->release(m);
}
int fmi2SetupExperiment(void *c, int with, double tolerance, double start, int ends, double stop) {
    Model *m = c;
    if (illegal(m, INSTANTIATED)) return ERROR;
    m->now.time = start;
    m->now.stop = ends ? stop : INFINITY;
    m->now.set_up = 1;
    return OK;
}
int fmi2EnterInitializationMode(void *c) {
    Model *m = c;
    if (illegal(m, INSTANTIATED)) return ERROR;
    if (!m->now.set_up && !IS("no experiment")) return fail(m, "there is no experiment");
    m->now.state = INITIALIZATION;
    return OK;
}
int fmi2ExitInitializationMode(void *c) {
    Model *m = c;
    if (illegal(m, INITIALIZATION)) return ERROR;
    m->now.state = COMPLETE;
    if (IS("state is shared")) shared = 0.0;
    return OK;
}
int fmi2Terminate(void *c) {
    Model *m = c;
    if (illegal(m, COMPLETE)) return ERROR;
    m->now.state = TERMINATED;
    return OK;
}
int fmi2Reset(void *c) {
    Model *m = c;
    double x = m->now.x;
    m->now = fresh();
    m->forgotten = -INFINITY;
    if (IS("a reset forgets to reset")) m->now.x = x;
    return OK;
}

int fmi2DoStep(void *c, double time, double step, int no_way_back) {
    Model *m = c;
    Values *now = &m->now;
    if (illegal(m, COMPLETE)) return ERROR;
    if (IS("the temporary files vanish")) exit(0);
    if (IS("history is dropped when it may be") && no_way_back) m->forgotten = time;
    if (IS("a step takes for ever"))
        for (;;) pause();
    if (fabs(time - now->time) > 1e-9 && !IS("a gap in time is accepted"))
        return fail(m, "this is not where the last step ended");
    if (fabs(step - 0.1) > 1e-9 && IS("one step size only")) return fail(m, "I step by 0.1 s");
    if (time + step > now->stop + 1e-9 && !IS("the stop time is passed"))
        return fail(m, "this is past the stop time");
    if (now->time > 2.15 && (IS("the run ends early") || IS("a step is discarded"))) return DISCARD;
    now->x += now->gain * now->u * (IS("the step size is ignored") ? 0.1 : step);
    if (IS("state is shared")) now->x = shared += now->u * step;
    if (IS("chance")) now->x += 1e-9 * ++calls;
    now->steps++;
    now->time = time + step;
    return OK;
}
int fmi2GetBooleanStatus(void *c, int kind, int *value) {
    if (!IS("the run ends early") && !IS("a step is discarded")) return fail(c, "no step was discarded");
    if (illegal(c, COMPLETE)) return ERROR;
    *value = IS("the run ends early");
    return OK;
}
int fmi2CancelStep(void *c) { return fail(c, "no step is in progress"); }

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    Model *m = c;
    if (illegal(m, ALIVE & ~INSTANTIATED)) return ERROR;
    if (IS("a crash")) *(volatile int *)NULL = 0;
    for (size_t i = 0; i < n; i++) {
        double y = IS("no number") && m->now.steps > 30 ? NAN : m->now.x + 0.5 * m->now.u;
        if (reference[i] > 2) {
            if (IS("an unknown reference is read")) y = *(volatile double *)NULL;
            if (IS("an unknown reference is accepted")) continue;
            return fail(m, "no variable has this reference");
        }
        value[i] = reference[i] == 0 ? y : reference[i] == 1 ? m->now.u : m->now.gain;
    }
    return OK;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    Model *m = c;
    if (illegal(m, INSTANTIATED | INITIALIZATION | COMPLETE)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (reference[i] == 1 && m->now.state == INITIALIZATION && IS("an input is refused"))
            return fail(m, "not this input, not now");
        if (reference[i] == 2 && m->now.state == COMPLETE && !IS("a fixed parameter moves"))
            return fail(m, "the gain is fixed");
        if (IS("an unknown reference is written") && reference[i] > 2) shared += 1.0;
        else if (reference[i] != 1 && reference[i] != 2 && !IS("an output can be set"))
            return fail(m, "this cannot be set");
    }
    if (IS("an unknown reference is written")) m->now.x += shared;
    for (size_t i = 0; i < n; i++) *(reference[i] == 1 ? &m->now.u : &m->now.gain) = value[i];
    return OK;
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) {
    if (illegal(c, ALIVE & ~INSTANTIATED)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (reference[i] > 0) return fail(c, "no Integer has this reference");
        value[i] = ((Model *)c)->now.steps;
    }
    return OK;
}
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) {
    return fail(c, "no Integer can be set");
}
int fmi2GetBoolean(void *c, const unsigned *reference, size_t n, int *value) {
    if (illegal(c, ALIVE & ~INSTANTIATED)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (reference[i] > 0) return fail(c, "no Boolean has this reference");
        value[i] = ((Model *)c)->now.on;
    }
    return OK;
}
int fmi2SetBoolean(void *c, const unsigned *reference, size_t n, const int *value) {
    if (illegal(c, INSTANTIATED | INITIALIZATION | COMPLETE)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (reference[i] > 0) return fail(c, "no Boolean has this reference");
        ((Model *)c)->now.on = value[i];
    }
    return OK;
}
int fmi2GetString(void *c, const unsigned *reference, size_t n, const char **value) {
    if (illegal(c, ALIVE & ~INSTANTIATED)) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (reference[i] > 0) return fail(c, "no String has this reference");
        value[i] = ((Model *)c)->now.label;
    }
    return OK;
}
int fmi2SetString(void *c, const unsigned *reference, size_t n, const char *const *value) {
    return fail(c, "no String can be set");
}

int fmi2GetFMUstate(void *c, void **state) {
    if (((Model *)c)->now.state == INITIALIZATION && IS("no state before the first step"))
        return fail(c, "there is no state yet");
    if (*state == NULL) *state = calloc(1, sizeof(Values));
    *(Values *)*state = ((Model *)c)->now;
    return OK;
}
int fmi2SetFMUstate(void *c, void *state) {
    Model *m = c;
    double x = m->now.x;
    int failed = m->now.state == FAILED;
    if (((Values *)state)->time < m->forgotten) return fail(m, "I have forgotten that time");
    m->now = *(Values *)state;
    if (failed && IS("an error is for ever")) m->now.state = FAILED;
    if (IS("a state forgets")) m->now.x = x;
    return OK;
}
int fmi2FreeFMUstate(void *c, void **state) {
    free(*state);
    *state = NULL;
    return OK;
}
int fmi2SerializedFMUstateSize(void *c, void *state, size_t *size) {
    *size = sizeof(Values);
    return OK;
}
int fmi2SerializeFMUstate(void *c, void *state, char *bytes, size_t size) {
    memcpy(bytes, state, sizeof(Values));
    return OK;
}
int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **state) {
    *state = calloc(1, sizeof(Values));
    memcpy(*state, bytes, sizeof(Values));
    if (IS("bytes forget")) ((Values *)*state)->x = 0.0;
    return OK;
}
int fmi2GetDirectionalDerivative(void *c, const unsigned *unknown, size_t unknowns,
                                 const unsigned *known, size_t knowns, const double *change,
                                 double *value) {
    if (illegal(c, ALIVE & ~INSTANTIATED)) return ERROR;
    if (IS("no derivative")) return fail(c, "not supported");
    for (size_t i = 0; i < unknowns; i++) value[i] = 0.0;
    for (size_t i = 0; i < unknowns; i++)
        for (size_t k = 0; k < knowns; k++)
            value[i] += (IS("a wrong derivative") ? 0.6 : 0.5) * change[k];
    return OK;
}
int fmi2SetRealInputDerivatives(void *c, const unsigned *reference, size_t n, const int *order,
                                const double *value) {
    if (illegal(c, INSTANTIATED | INITIALIZATION | COMPLETE)) return ERROR;
    return IS("a slope is refused") ? fail(c, "not supported") : OK;
}
int fmi2GetRealOutputDerivatives(void *c, const unsigned *reference, size_t n, const int *order,
                                 double *value) {
    return fail(c, "not supported");
}

