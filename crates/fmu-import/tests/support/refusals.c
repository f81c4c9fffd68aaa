/* The functions of FMI 2.0 that an FMU without the optional capabilities exports. An FMU that has one of them defines it itself. */
#include "fmi2.h"

/* A library for Windows does not export weak functions: there the linker takes the first definition. */
#ifdef _WIN32
#define WEAK
#else
#define WEAK __attribute__((weak))
#endif

WEAK const char *fmi2GetTypesPlatform(void) { return "default"; }
WEAK const char *fmi2GetVersion(void) { return "2.0"; }
WEAK int fmi2SetDebugLogging(void *m, int on, size_t n, const char *const *categories) { return OK; }
WEAK int fmi2CancelStep(void *m) { return ERROR; }

WEAK int fmi2GetFMUstate(void *m, void **state) { return ERROR; }
WEAK int fmi2SetFMUstate(void *m, void *state) { return ERROR; }
WEAK int fmi2FreeFMUstate(void *m, void **state) { return ERROR; }
WEAK int fmi2SerializedFMUstateSize(void *m, void *state, size_t *size) { return ERROR; }
WEAK int fmi2SerializeFMUstate(void *m, void *state, char *bytes, size_t size) { return ERROR; }
WEAK int fmi2DeSerializeFMUstate(void *m, const char *bytes, size_t size, void **state) {
    return ERROR;
}
WEAK int fmi2GetDirectionalDerivative(void *m, const unsigned *unknown, size_t unknowns,
                                      const unsigned *known, size_t knowns, const double *change,
                                      double *value) {
    return ERROR;
}
WEAK int fmi2SetRealInputDerivatives(void *m, const unsigned *reference, size_t n, const int *order,
                                     const double *value) {
    return ERROR;
}
WEAK int fmi2GetRealOutputDerivatives(void *m, const unsigned *reference, size_t n,
                                      const int *order, double *value) {
    return ERROR;
}

WEAK int fmi2GetStatus(void *m, int kind, int *value) { return DISCARD; }
WEAK int fmi2GetRealStatus(void *m, int kind, double *value) { return DISCARD; }
WEAK int fmi2GetIntegerStatus(void *m, int kind, int *value) { return DISCARD; }
WEAK int fmi2GetBooleanStatus(void *m, int kind, int *value) { return DISCARD; }
WEAK int fmi2GetStringStatus(void *m, int kind, const char **value) { return DISCARD; }
