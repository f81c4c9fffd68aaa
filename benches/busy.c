/* An FMU of FMI 2.0 whose step takes as long as the parameter `rounds` says: an oscillator of one mass, stepped so often by the method of Euler. */
#include <stddef.h>
#include <stdlib.h>

typedef struct {
    double x, v, u;
    int rounds;
} Model;

const char *fmi2GetVersion(void) { return "2.0"; }
const char *fmi2GetTypesPlatform(void) { return "default"; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources, const void *callbacks,
                      int visible, int logging) {
    Model *m = calloc(1, sizeof(Model));
    m->x = 1.0;
    return m;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int with, double tolerance, double start, int ends, double stop) { return 0; }
int fmi2EnterInitializationMode(void *c) { return 0; }
int fmi2ExitInitializationMode(void *c) { return 0; }
int fmi2Terminate(void *c) { return 0; }
int fmi2Reset(void *c) { return 0; }

int fmi2DoStep(void *c, double time, double step, int keep) {
    Model *m = c;
    double h = step / m->rounds;
    for (int i = 0; i < m->rounds; i++) {
        double a = m->u - m->x - 0.1 * m->v;
        m->x += h * m->v;
        m->v += h * a;
    }
    return 0;
}
int fmi2CancelStep(void *c) { return 3; }

int fmi2GetReal(void *c, const unsigned *reference, size_t n, double *value) {
    for (size_t i = 0; i < n; i++) value[i] = ((Model *)c)->x;
    return 0;
}
int fmi2SetReal(void *c, const unsigned *reference, size_t n, const double *value) {
    if (n > 0) ((Model *)c)->u = value[n - 1];
    return 0;
}
int fmi2SetInteger(void *c, const unsigned *reference, size_t n, const int *value) {
    if (n > 0) ((Model *)c)->rounds = value[n - 1];
    return 0;
}
int fmi2GetInteger(void *c, const unsigned *reference, size_t n, int *value) {
    if (n > 0) value[0] = ((Model *)c)->rounds;
    return 0;
}

/* What it cannot do. */
#define REFUSES(name) int fmi2##name(void) { return 3; }
REFUSES(SetDebugLogging)
REFUSES(GetBoolean)
REFUSES(SetBoolean)
REFUSES(GetString)
REFUSES(SetString)
REFUSES(GetFMUstate)
REFUSES(SetFMUstate)
REFUSES(FreeFMUstate)
REFUSES(SerializedFMUstateSize)
REFUSES(SerializeFMUstate)
REFUSES(DeSerializeFMUstate)
REFUSES(GetDirectionalDerivative)
REFUSES(SetRealInputDerivatives)
REFUSES(GetRealOutputDerivatives)
REFUSES(GetStatus)
REFUSES(GetRealStatus)
REFUSES(GetIntegerStatus)
REFUSES(GetBooleanStatus)
REFUSES(GetStringStatus)
