/* Integrates an input, and shows values of all types, with negated aliases: an FMU of FMI 1.0 for co-simulation. */
#define MODEL slave1
#include "fmi1.h"

#include <stdio.h>
#include <string.h>

enum { U, K, Y, MINUS_G, REALS };
enum { STEPS, LATE, INTEGERS };
enum { ON, IS_ON, BROKEN, BOOLEANS };
enum { TEXT, SAID, STRINGS };

typedef struct {
    SlaveCallbacks callbacks;
    char name[64];
    double reals[REALS];
    int integers[INTEGERS];
    Boolean booleans[BOOLEANS];
    char texts[STRINGS][160];
    int initialised, asked;
} Slave;

const char *FMI(GetTypesPlatform)(void) { return "standard32"; }
const char *FMI(GetVersion)(void) { return "1.0"; }
Status FMI(SetDebugLogging)(Component c, Boolean on) { return c && on <= 1 ? OK : ERROR; }

static void begin(Slave *slave) {
    slave->reals[K] = 2;
    slave->reals[Y] = 0;
    slave->reals[MINUS_G] = -9.81;
    memset(slave->integers, 0, sizeof slave->integers);
    memset(slave->booleans, 0, sizeof slave->booleans);
    slave->initialised = 0;
}

Component FMI(InstantiateSlave)(const char *name, const char *guid, const char *location, const char *mime,
                                double timeout, Boolean visible, Boolean interactive, SlaveCallbacks callbacks,
                                Boolean logging) {
    Slave *slave;
    if (strcmp(guid, "{slave1}") || strncmp(location, "file:///", 8) || timeout != 0 || visible || interactive ||
        logging > 1) {
        callbacks.logger(NULL, name, ERROR, "error", "found the GUID %s", guid);
        return NULL;
    }
    slave = callbacks.allocate(1, sizeof *slave);
    slave->callbacks = callbacks;
    snprintf(slave->name, sizeof slave->name, "%s", name);
    begin(slave);
    callbacks.logger(NULL, name, WARNING, "", "made as %s", mime);
    return slave;
}

void FMI(FreeSlaveInstance)(Component c) {
    Slave *slave = c;
    slave->callbacks.release(slave);
}

Status FMI(InitializeSlave)(Component c, double start, Boolean stops, double stop) {
    Slave *slave = c;
    slave->initialised = 1;
    if (slave->texts[TEXT][0]) {
        snprintf(slave->texts[SAID], sizeof slave->texts[SAID], "%.40s: %g to %g", slave->texts[TEXT], start,
                 stops ? stop : -1);
    }
    return OK;
}

Status FMI(TerminateSlave)(Component c) { return c ? OK : ERROR; }

Status FMI(ResetSlave)(Component c) {
    begin(c);
    return OK;
}

Status FMI(DoStep)(Component c, double time, double step, Boolean is_new) {
    Slave *slave = c;
    if (slave->booleans[BROKEN]) {
        slave->callbacks.logger(c, slave->name, ERROR, "error", "%s at %g s", "it broke", time);
        return ERROR;
    }
    if (!slave->initialised || !is_new) {
        return ERROR;
    }
    slave->reals[Y] += step * slave->reals[K] * slave->reals[U];
    slave->integers[STEPS]++;
    slave->booleans[IS_ON] = slave->booleans[ON];
    slave->asked = slave->integers[LATE];
    if (slave->integers[STEPS] == 1) {
        slave->callbacks.logger(c, slave->name, WARNING, "", "a step of %g s", step);
    }
    return slave->asked > 0 ? PENDING : OK;
}

Status FMI(CancelStep)(Component c) { return c ? ERROR : FATAL; }

Status FMI(GetStatus)(Component c, int kind, Status *value) {
    Slave *slave = c;
    *value = kind == 0 && slave->asked-- > 1 ? PENDING : OK;
    return OK;
}

Status FMI(GetRealStatus)(Component c, int kind, double *value) {
    (void)kind, (void)value;
    return c ? DISCARD : ERROR;
}

Status FMI(SetRealInputDerivatives)(Component c, const unsigned *r, size_t n, const int *order, const double *v) {
    (void)r, (void)n, (void)order, (void)v;
    return c ? ERROR : FATAL;
}

Status FMI(GetRealOutputDerivatives)(Component c, const unsigned *r, size_t n, const int *order, double *v) {
    (void)r, (void)n, (void)order, (void)v;
    return c ? ERROR : FATAL;
}

#define ACCESS(Name, Type, list, COUNT)                                                          \
    Status FMI(Get##Name)(Component c, const unsigned *r, size_t n, Type *v) {                   \
        Slave *slave = c;                                                                        \
        for (size_t i = 0; i < n; i++) {                                                         \
            if (r[i] >= COUNT) return ERROR;                                                     \
            v[i] = slave->list[r[i]];                                                            \
        }                                                                                        \
        return OK;                                                                               \
    }                                                                                            \
    Status FMI(Set##Name)(Component c, const unsigned *r, size_t n, const Type *v) {             \
        Slave *slave = c;                                                                        \
        for (size_t i = 0; i < n; i++) {                                                         \
            if (r[i] >= COUNT) return ERROR;                                                     \
            slave->list[r[i]] = v[i];                                                            \
        }                                                                                        \
        return OK;                                                                               \
    }
ACCESS(Real, double, reals, REALS)
ACCESS(Integer, int, integers, INTEGERS)
ACCESS(Boolean, Boolean, booleans, BOOLEANS)

Status FMI(GetString)(Component c, const unsigned *r, size_t n, const char **v) {
    Slave *slave = c;
    for (size_t i = 0; i < n; i++) v[i] = slave->texts[r[i]];
    return OK;
}

Status FMI(SetString)(Component c, const unsigned *r, size_t n, const char *const *v) {
    Slave *slave = c;
    for (size_t i = 0; i < n; i++) snprintf(slave->texts[r[i]], sizeof slave->texts[r[i]], "%s", v[i]);
    return OK;
}
