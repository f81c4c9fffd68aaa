/* A ball that bounces, and counts at a time that it asks for: an FMU of FMI 1.0 for model exchange. */
#define MODEL ball1
#include "fmi1.h"

#include <float.h>
#include <string.h>

enum { H, V, G, E, REALS };

typedef struct {
    ModelCallbacks callbacks;
    double time, reals[REALS];
    int ticks, initialised;
} Ball;

const char *FMI(GetModelTypesPlatform)(void) { return "standard32"; }
const char *FMI(GetVersion)(void) { return "1.0"; }
Status FMI(SetDebugLogging)(Component c, Boolean on) { return c && on <= 1 ? OK : ERROR; }

Component FMI(InstantiateModel)(const char *name, const char *guid, ModelCallbacks callbacks, Boolean logging) {
    static const double start[REALS] = {1, 0, 9.81, 0.7};
    Ball *ball;
    if (strcmp(guid, "{ball1}") || logging > 1) {
        return NULL;
    }
    ball = callbacks.allocate(1, sizeof *ball);
    ball->callbacks = callbacks;
    memcpy(ball->reals, start, sizeof start);
    callbacks.logger(ball, name, WARNING, "", "a ball of %s", "FMI 1.0");
    return ball;
}

void FMI(FreeModelInstance)(Component c) {
    Ball *ball = c;
    ball->callbacks.release(ball);
}

static void ask(const Ball *ball, EventInfo *info) {
    memset(info, 0, sizeof *info);
    info->converged = 1;
    info->upcoming_time_event = ball->ticks == 0;
    info->next_time = 0.25;
}

Status FMI(Initialize)(Component c, Boolean controlled, double tolerance, EventInfo *info) {
    Ball *ball = c;
    ball->initialised = 1;
    ask(ball, info);
    return controlled && tolerance > 0 ? OK : ERROR;
}

Status FMI(SetTime)(Component c, double time) {
    Ball *ball = c;
    ball->time = time;
    return OK;
}

Status FMI(SetContinuousStates)(Component c, const double *x, size_t n) {
    Ball *ball = c;
    memcpy(ball->reals, x, n * sizeof *x);
    return OK;
}

Status FMI(GetContinuousStates)(Component c, double *x, size_t n) {
    Ball *ball = c;
    memcpy(x, ball->reals, n * sizeof *x);
    return OK;
}

Status FMI(GetNominalContinuousStates)(Component c, double *x, size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1;
    return c ? OK : ERROR;
}

Status FMI(GetStateValueReferences)(Component c, unsigned *r, size_t n) {
    for (size_t i = 0; i < n; i++) r[i] = i;
    return c ? OK : ERROR;
}

Status FMI(GetDerivatives)(Component c, double *dx, size_t n) {
    Ball *ball = c;
    dx[0] = ball->reals[V];
    dx[1] = -ball->reals[G];
    return n == 2 && ball->initialised ? OK : ERROR;
}

Status FMI(GetEventIndicators)(Component c, double *z, size_t n) {
    Ball *ball = c;
    z[0] = ball->reals[H] == 0 && ball->reals[V] == 0 ? 1 : ball->reals[H];
    return n == 1 ? OK : ERROR;
}

Status FMI(CompletedIntegratorStep)(Component c, Boolean *event) {
    *event = 0;
    return c ? OK : ERROR;
}

Status FMI(EventUpdate)(Component c, Boolean intermediate, EventInfo *info) {
    Ball *ball = c;
    double *x = ball->reals;
    if (ball->ticks == 0 && ball->time == 0.25) {
        ball->ticks = 1;
    }
    ask(ball, info);
    if (x[H] <= 0 && x[V] < 0) {
        x[H] = DBL_MIN;
        x[V] *= -x[E];
        info->values_changed = 1;
        if (x[V] < 0.1) {
            x[H] = x[V] = x[G] = 0;
        }
    }
    return intermediate ? ERROR : OK;
}

Status FMI(Terminate)(Component c) { return c ? OK : ERROR; }

Status FMI(GetReal)(Component c, const unsigned *r, size_t n, double *v) {
    Ball *ball = c;
    for (size_t i = 0; i < n; i++) v[i] = ball->reals[r[i]];
    return OK;
}

Status FMI(SetReal)(Component c, const unsigned *r, size_t n, const double *v) {
    Ball *ball = c;
    for (size_t i = 0; i < n; i++) ball->reals[r[i]] = v[i];
    return OK;
}

Status FMI(GetInteger)(Component c, const unsigned *r, size_t n, int *v) {
    Ball *ball = c;
    for (size_t i = 0; i < n; i++) v[i] = ball->ticks + (int)r[i];
    return OK;
}

#define REFUSED(Name, Type)                                                                                    \
    Status FMI(Name)(Component c, const unsigned *r, size_t n, Type *v) { return c && r && n && v ? ERROR : OK; }
REFUSED(SetInteger, const int)
REFUSED(GetBoolean, Boolean)
REFUSED(SetBoolean, const Boolean)
REFUSED(GetString, const char *)
REFUSED(SetString, const char *const)
