/* Steps a chain of instances of one FMU of FMI 2.0 with nothing around the calls: the least that any program needs.
   bare LIBRARY GUID RESOURCES INPUT OUTPUT COUNT STEPS, with value references of Real variables. Prints the processor time of a step [ns]. */
#include "fmi2_calls.h"

typedef int (*Set)(Component, const unsigned *, size_t, const double *);
typedef int (*Step)(Component, double, double, int);

static const double STEP = 0.1;

int main(int count, char **words) {
    if (count != 8) return fprintf(stderr, "expected LIBRARY GUID RESOURCES INPUT OUTPUT COUNT STEPS\n"), 2;
    void *library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    const unsigned input = (unsigned)atoi(words[4]), output = (unsigned)atoi(words[5]);
    const long nodes = atol(words[6]), steps = atol(words[7]);
    Component *chain = calloc((size_t)nodes, sizeof *chain);
    int status = 0;
    for (long i = 0; i < nodes; i++) {
        char name[32];
        snprintf(name, sizeof name, "n%ld", i);
        chain[i] = ((Instantiate)find(library, "fmi2Instantiate"))(name, 1, words[2], words[3], &CALLBACKS, 0, 0);
        if (!chain[i]) return fprintf(stderr, "no instance\n"), 1;
        status |= ((Setup)find(library, "fmi2SetupExperiment"))(chain[i], 0, 0, 0, 0, 0);
        status |= ((Call)find(library, "fmi2EnterInitializationMode"))(chain[i]);
        status |= ((Call)find(library, "fmi2ExitInitializationMode"))(chain[i]);
    }
    const Set set = (Set)find(library, "fmi2SetReal");
    const GetReal get = (GetReal)find(library, "fmi2GetReal");
    const Step step = (Step)find(library, "fmi2DoStep");
    struct timespec begin, end;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    for (long tick = 0; tick < steps; tick++) {
        double value = (double)tick;
        for (long i = 0; i < nodes; i++) {
            status |= set(chain[i], &input, 1, &value);
            status |= step(chain[i], (double)tick * STEP, STEP, 1);
            status |= get(chain[i], &output, 1, &value);
        }
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    if (status) return fprintf(stderr, "the FMU returned %d\n", status), 1;
    printf("%.3f\n", nanoseconds(begin, end) / (double)steps);
    return 0;
}
