/* Runs an FMU's library through all it can do and unloads it, for a memory checker to look at:
   host LIBRARY GUID INPUTS OUTPUTS, the last two being value references of real variables with commas between. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2.h"

enum { MOST = 256, STEPS = 100 };

static void *library;

static void fail(const char *what) {
    fprintf(stderr, "%s\n", what);
    exit(1);
}
static void *function(const char *name) {
    void *found = dlsym(library, name);
    if (!found) fail(name);
    return found;
}
/* Calls a function that returns a status, by the types of its arguments. */
#define CALL(name, types, ...) (((int(*) types)function(name))(__VA_ARGS__))
#define MUST(name, types, ...) \
    if (CALL(name, types, __VA_ARGS__) != 0) fail(name)

static void log_message(void *environment, const char *instance, int status, const char *category,
                        const char *format, ...) {
    char text[4096];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    printf("%s %d %s: %s\n", instance, status, category, text);
}

static size_t numbers(char *list, unsigned *into) {
    size_t n = 0;
    for (char *word = strtok(list, ","); word && n < MOST; word = strtok(NULL, ","))
        into[n++] = (unsigned)strtoul(word, NULL, 10);
    return n;
}

static unsigned in[MOST], out[MOST];
static size_t ins, outs;
static double values[MOST];

static void *instantiate(const char *guid, int logging) {
    static Callbacks callbacks = {log_message, calloc, free, NULL, NULL};
    typedef void *Instantiate(const char *, int, const char *, const char *, const Callbacks *, int, int);
    Instantiate *make = (Instantiate *)function("fmi2Instantiate");
    return make("host", 1, guid, "file:///nowhere", &callbacks, 0, logging);
}

static void initialise(void *c) {
    MUST("fmi2SetupExperiment", (void *, int, double, double, int, double), c, 1, 1e-4, 0.0, 1, 1000.0);
    MUST("fmi2EnterInitializationMode", (void *), c);
    MUST("fmi2ExitInitializationMode", (void *), c);
}

static void steps(void *c, int from, int to) {
    double given[MOST];
    MUST("fmi2GetReal", (void *, unsigned *, size_t, double *), c, in, ins, given);
    for (int k = from; k < to; k++) {
        MUST("fmi2SetReal", (void *, unsigned *, size_t, double *), c, in, ins, given);
        MUST("fmi2DoStep", (void *, double, double, int), c, 0.01 * k, 0.01, 1);
        MUST("fmi2GetReal", (void *, unsigned *, size_t, double *), c, out, outs, values);
    }
}

/* The state goes through its whole life: taken, taken again, bytes, restored, freed. */
static void state(void *c) {
    void *taken = NULL, *copy = NULL;
    size_t size = 0;
    MUST("fmi2GetFMUstate", (void *, void **), c, &taken);
    MUST("fmi2GetFMUstate", (void *, void **), c, &taken);
    MUST("fmi2SerializedFMUstateSize", (void *, void *, size_t *), c, taken, &size);
    char *bytes = malloc(size);
    MUST("fmi2SerializeFMUstate", (void *, void *, char *, size_t), c, taken, bytes, size);
    MUST("fmi2DeSerializeFMUstate", (void *, char *, size_t, void **), c, bytes, size, &copy);
    if (CALL("fmi2DeSerializeFMUstate", (void *, char *, size_t, void **), c, bytes, size / 2, &(void *){0}) == 0)
        fail("half of a state was accepted");
    free(bytes);
    MUST("fmi2SetFMUstate", (void *, void *), c, taken);
    MUST("fmi2FreeFMUstate", (void *, void **), c, &taken);
    MUST("fmi2SetFMUstate", (void *, void *), c, copy);
    MUST("fmi2FreeFMUstate", (void *, void **), c, &copy);
}

/* How many derivatives of an output with respect to an input there are; the others are refused. */
static int derivatives(void *c) {
    typedef int Derivative(void *, unsigned *, size_t, unsigned *, size_t, double *, double *);
    Derivative *derivative = (Derivative *)function("fmi2GetDirectionalDerivative");
    int known = 0;
    double change = 1.0, response;
    for (size_t i = 0; i < outs; i++)
        for (size_t j = 0; j < ins; j++)
            known += derivative(c, &out[i], 1, &in[j], 1, &change, &response) == 0;
    int order = 1;
    for (size_t j = 0; j < ins; j++)
        MUST("fmi2SetRealInputDerivatives", (void *, unsigned *, size_t, int *, double *), c, &in[j], 1, &order,
             &(double){0.0});
    return known;
}

int main(int arguments, char **argument) {
    if (arguments != 5) fail("host LIBRARY GUID INPUTS OUTPUTS");
    library = dlopen(argument[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
    ins = numbers(argument[3], in);
    outs = numbers(argument[4], out);
    if (instantiate("{another}", 1)) fail("another GUID was accepted");
    int known = 0;
    for (int logging = 0; logging < 2; logging++) {
        void *c = instantiate(argument[2], logging);
        if (!c) fail("no instance");
        initialise(c);
        steps(c, 0, STEPS / 2);
        state(c);
        known = derivatives(c);
        steps(c, STEPS / 2, STEPS);
        if (CALL("fmi2DoStep", (void *, double, double, int), c, 5.0, 0.01, 1) == 0) fail("a gap was accepted");
        MUST("fmi2Terminate", (void *), c);
        MUST("fmi2Reset", (void *), c);
        initialise(c);
        steps(c, 0, STEPS);
        ((void (*)(void *))function("fmi2FreeInstance"))(c);
    }
    dlclose(library);
    if (dlopen(argument[1], RTLD_NOW | RTLD_NOLOAD)) fail("the library cannot be unloaded");
    printf("%d derivatives\n", known);
    return 0;
}
