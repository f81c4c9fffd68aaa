/* Integrates one FMU of FMI 2.0 for model exchange by CVODE (BDF, dense Jacobian by differences): what the integrator of trackside is compared with.
   cvode LIBRARY GUID RESOURCES STATES INDICATORS STEP STEPS TOLERANCE OUTPUT. The absolute tolerance is TOLERANCE / 100 of each nominal value.
   Prints processor time of a step [ns], evaluations of the derivatives, and the Real variable OUTPUT at the end. */
#include "fmi2_calls.h"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

typedef struct {
    int again, terminate, nominals, values, defined;
    double next;
} EventInfo;
typedef int (*SetTime)(Component, double);
typedef int (*SetStates)(Component, const double *, size_t);
typedef int (*GetNumbers)(Component, double *, size_t);
typedef int (*Update)(Component, EventInfo *);

static Component fmu;
static size_t states, indicators;
static SetTime set_time;
static SetStates set_states;
static GetNumbers get_derivatives, get_indicators, get_states, get_nominals;
static Call enter_events, leave_events;
static Update update;
static int status;

static void put(double t, N_Vector x) {
    status |= set_time(fmu, t);
    status |= set_states(fmu, N_VGetArrayPointer(x), states);
}

static int derivatives(double t, N_Vector x, N_Vector dx, void *data) {
    (void)data;
    put(t, x);
    status |= get_derivatives(fmu, N_VGetArrayPointer(dx), states);
    return status;
}

static int roots(double t, N_Vector x, double *z, void *data) {
    (void)data;
    put(t, x);
    status |= get_indicators(fmu, z, indicators);
    return status;
}

/* The time of the next event that the FMU wants, or a late one. */
static double handle_event(N_Vector x) {
    EventInfo info = {1, 0, 0, 0, 0, 0};
    while (info.again && !info.terminate) status |= update(fmu, &info);
    status |= leave_events(fmu);
    status |= get_states(fmu, N_VGetArrayPointer(x), states);
    return info.defined ? info.next : 1e300;
}

int main(int count, char **words) {
    if (count != 10) return fprintf(stderr, "expected LIBRARY GUID RESOURCES STATES INDICATORS STEP STEPS TOLERANCE OUTPUT\n"), 2;
    void *library = dlopen(words[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) return fprintf(stderr, "%s\n", dlerror()), 1;
    states = (size_t)atol(words[4]), indicators = (size_t)atol(words[5]);
    const double step = atof(words[6]), tolerance = atof(words[8]);
    const long steps = atol(words[7]);
    const unsigned output = (unsigned)atoi(words[9]);
    set_time = (SetTime)find(library, "fmi2SetTime");
    set_states = (SetStates)find(library, "fmi2SetContinuousStates");
    get_derivatives = (GetNumbers)find(library, "fmi2GetDerivatives");
    get_indicators = (GetNumbers)find(library, "fmi2GetEventIndicators");
    get_states = (GetNumbers)find(library, "fmi2GetContinuousStates");
    get_nominals = (GetNumbers)find(library, "fmi2GetNominalsOfContinuousStates");
    enter_events = (Call)find(library, "fmi2EnterEventMode");
    leave_events = (Call)find(library, "fmi2EnterContinuousTimeMode");
    update = (Update)find(library, "fmi2NewDiscreteStates");
    fmu = ((Instantiate)find(library, "fmi2Instantiate"))("model", 0, words[2], words[3], &CALLBACKS, 0, 0);
    if (!fmu) return fprintf(stderr, "no instance\n"), 1;
    status |= ((Setup)find(library, "fmi2SetupExperiment"))(fmu, 0, 0, 0, 0, 0);
    status |= ((Call)find(library, "fmi2EnterInitializationMode"))(fmu);
    status |= ((Call)find(library, "fmi2ExitInitializationMode"))(fmu);

    SUNContext context;
    SUNContext_Create(NULL, &context);
    N_Vector x = N_VNew_Serial((long)states, context), absolute = N_VNew_Serial((long)states, context);
    double event = handle_event(x);
    status |= get_nominals(fmu, N_VGetArrayPointer(absolute), states);
    N_VScale(0.01 * tolerance, absolute, absolute);
    void *solver = CVodeCreate(CV_BDF, context);
    CVodeInit(solver, derivatives, 0, x);
    CVodeSVtolerances(solver, tolerance, absolute);
    SUNMatrix matrix = SUNDenseMatrix((long)states, (long)states, context);
    CVodeSetLinearSolver(solver, SUNLinSol_Dense(x, matrix, context), matrix);
    CVodeSetMaxNumSteps(solver, 1000000);
    CVodeSetNoInactiveRootWarn(solver);
    if (indicators) CVodeRootInit(solver, (int)indicators, roots);
    struct timespec begin, end;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    double time = 0, value = 0;
    long evaluations = 0, some;
    for (long tick = 1; tick <= steps; tick++) {
        const double point = (double)tick * step;
        while (time < point && !status) {
            const double stop = event < point ? event : point;
            const int result = CVode(solver, stop, x, &time, CV_NORMAL);
            if (result < 0) return fprintf(stderr, "CVode returned %d at %g\n", result, time), 1;
            put(time, x);
            if (result == CV_ROOT_RETURN || time >= event) {
                status |= enter_events(fmu);
                event = handle_event(x);
                CVodeGetNumRhsEvals(solver, &some), evaluations += some;
                CVodeReInit(solver, time, x);
            }
        }
        status |= ((GetReal)find(library, "fmi2GetReal"))(fmu, &output, 1, &value);
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    if (status) return fprintf(stderr, "the FMU returned %d\n", status), 1;
    CVodeGetNumRhsEvals(solver, &some);
    printf("%.1f %ld %.17g\n", nanoseconds(begin, end) / (double)steps, evaluations + some, value);
    return 0;
}
