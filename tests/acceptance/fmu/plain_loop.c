/* Runs an FMU by the bare calls of FMI 1.0, 2.0 or 3.0, and writes what it reads: plain_loop LIBRARY PLAN VALUES.
 * One file for Linux and, by mingw-w64, for Windows. It shares nothing with Trackside: the types below are those of the standards.
 *
 * An FMU for co-simulation does its steps. The equations of one for model exchange are integrated by the classical method of Runge and
 * Kutta in so many equal steps, up to its first event.
 *
 * The plan has one word and its value in a line, then a line `get TYPE COUNT REFERENCE` for each variable. The values have one line for
 * each communication point: reals as the hexadecimal digits of their bits, integers in decimal, texts as hexadecimal digits. The last line says how it
 * ended. */
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
#include <windows.h>
#else
#include <dlfcn.h>
#endif

enum { OK, WARNING, DISCARD, ERROR_STATUS, MOST_VARIABLES = 4096, MOST_UPDATES = 1000 };

/* A difference of times that is rounding, as a share of the step. */
#define SAME 1e-9

typedef struct {
    char type[16];
    size_t count;
    uint32_t reference;
} Variable;

static struct {
    int version;
    char identifier[512], guid[1024], resources[4096];
    double start, step, stop, tolerance;
    long steps;
    /* For model exchange: steps of the integrator in a communication step, and what the description counts. */
    long integrator_steps;
    size_t states, indicators;
    bool event_mode, early_return, variable_step;
} plan;
static Variable variables[MOST_VARIABLES];
static size_t variable_count;
static FILE *values;
static void *instance;
static double next_event;
static bool has_next_event;

static void end(const char *how) {
    fprintf(values, "end %s\n", how);
    fclose(values);
    /* Freeing is not what is compared, and no crash there shall hide the values. */
    _Exit(0);
}

static void *library;

/* FMI 3.0 has none where the archive has no such folder. */
static const char *resource_path(void) { return plan.resources[0] ? plan.resources : NULL; }

static void *find(const char *name) {
    char full[600];
    if (plan.version == 1)
        snprintf(full, sizeof full, "%s_fmi%s", plan.identifier, name);
    else
        snprintf(full, sizeof full, "fmi%d%s", plan.version, name);
#ifdef _WIN32
    void *found = (void *)GetProcAddress(library, full);
#else
    void *found = dlsym(library, full);
#endif
    if (!found) {
        char what[700];
        snprintf(what, sizeof what, "no function %s", full);
        end(what);
    }
    return found;
}

static void log_2(void *environment, const char *name, int status, const char *category, const char *text, ...) {
    (void)environment, (void)name, (void)category;
    va_list rest;
    va_start(rest, text);
    if (status > WARNING && text) {
        vfprintf(stderr, text, rest);
        fputc('\n', stderr);
    }
    va_end(rest);
}

static void log_3(void *environment, int status, const char *category, const char *text) {
    (void)environment, (void)category;
    if (status > WARNING && text)
        fprintf(stderr, "%s\n", text);
}

static void intermediate(void *environment, double time, bool set, bool get, bool finished, bool may, bool *wanted, double *early) {
    (void)environment, (void)set, (void)get, (void)finished, (void)may;
    if (wanted)
        *wanted = false;
    if (early)
        *early = time;
}

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks2;

/* Of co-simulation; handed over by value. */
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
} Callbacks1;

static void must(const char *call, int status) {
    char what[128];
    if (status > WARNING) {
        snprintf(what, sizeof what, "%s returned %d", call, status);
        end(what);
    }
}

static void put_bytes(const void *bytes, size_t count) {
    fputs(" s", values);
    for (size_t i = 0; i < count; i++)
        fprintf(values, "%02x", ((const unsigned char *)bytes)[i]);
}

static void put_text(const char *text) { put_bytes(text ? text : "", text ? strlen(text) : 0); }

static void put_real(double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    fprintf(values, " x%016llx", (unsigned long long)bits);
}

typedef int (*GetFn)(void *, const uint32_t *, size_t, void *);
typedef int (*Get3Fn)(void *, const uint32_t *, size_t, void *, size_t);
typedef int (*GetBinaryFn)(void *, const uint32_t *, size_t, size_t *, const unsigned char **, size_t);

static int fetch(const Variable *it, const char *type, void *into) {
    char name[64];
    snprintf(name, sizeof name, "Get%s", type);
    if (plan.version < 3)
        return ((GetFn)find(name))(instance, &it->reference, 1, into);
    return ((Get3Fn)find(name))(instance, &it->reference, 1, into, it->count);
}

#define INTEGERS(TYPE, C, FORMAT, WIDE)                              \
    if (!strcmp(type, TYPE)) {                                       \
        C *own = calloc(it->count, sizeof(C));                       \
        must("Get" TYPE, fetch(it, TYPE, own));                      \
        for (size_t i = 0; i < it->count; i++)                       \
            fprintf(values, " " FORMAT, (WIDE)own[i]);               \
        free(own);                                                   \
        return;                                                      \
    }

static void get(const Variable *it) {
    const char *type = it->type;
    if (!strcmp(type, "Real") || !strcmp(type, "Float64")) {
        double *own = calloc(it->count, sizeof *own);
        must("Get of a real", fetch(it, type, own));
        for (size_t i = 0; i < it->count; i++)
            put_real(own[i]);
        free(own);
        return;
    }
    if (!strcmp(type, "Float32")) {
        float *own = calloc(it->count, sizeof *own);
        must("GetFloat32", fetch(it, type, own));
        for (size_t i = 0; i < it->count; i++)
            put_real(own[i]);
        free(own);
        return;
    }
    if (!strcmp(type, "String")) {
        const char **own = calloc(it->count, sizeof *own);
        must("GetString", fetch(it, type, own));
        for (size_t i = 0; i < it->count; i++)
            put_text(own[i]);
        free(own);
        return;
    }
    if (!strcmp(type, "Binary")) {
        const unsigned char **own = calloc(it->count, sizeof *own);
        size_t *sizes = calloc(it->count, sizeof *sizes);
        must("GetBinary", ((GetBinaryFn)find("GetBinary"))(instance, &it->reference, 1, sizes, own, it->count));
        for (size_t i = 0; i < it->count; i++)
            put_bytes(own[i], sizes[i]);
        free(own), free(sizes);
        return;
    }
    if (plan.version == 1)
        INTEGERS("Boolean", char, "%d", int)
    if (plan.version == 2)
        INTEGERS("Boolean", int, "%d", int)
    INTEGERS("Boolean", bool, "%d", int)
    INTEGERS("Integer", int, "%d", int)
    INTEGERS("Int8", int8_t, "%d", int)
    INTEGERS("UInt8", uint8_t, "%d", int)
    INTEGERS("Int16", int16_t, "%d", int)
    INTEGERS("UInt16", uint16_t, "%d", int)
    INTEGERS("Int32", int32_t, "%lld", long long)
    INTEGERS("UInt32", uint32_t, "%lld", long long)
    INTEGERS("Int64", int64_t, "%lld", long long)
    INTEGERS("UInt64", uint64_t, "%llu", unsigned long long)
    end("no such type");
}

static void write_row(double time) {
    fputs("row", values);
    put_real(time);
    for (size_t i = 0; i < variable_count; i++)
        get(&variables[i]);
    fputc('\n', values);
    fflush(values);
}

static void instantiate(void) {
    if (plan.version == 1) {
        Callbacks1 own = {log_2, calloc, free, NULL};
        typedef void *(*Fn)(const char *, const char *, const char *, const char *, double, char, char, Callbacks1, char);
        instance = ((Fn)find("InstantiateSlave"))("it", plan.guid, plan.resources, "application/x-fmu-sharedlibrary", 0.0, 0, 0, own, 0);
    } else if (plan.version == 2) {
        static Callbacks2 own = {log_2, calloc, free, NULL, NULL};
        typedef void *(*Fn)(const char *, int, const char *, const char *, const Callbacks2 *, int, int);
        instance = ((Fn)find("Instantiate"))("it", 1, plan.guid, plan.resources, &own, 0, 0);
    } else {
        typedef void *(*Fn)(const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *,
                            void (*)(void *, int, const char *, const char *),
                            void (*)(void *, double, bool, bool, bool, bool, bool *, double *));
        instance = ((Fn)find("InstantiateCoSimulation"))("it", plan.guid, resource_path(), false, false, plan.event_mode,
                                                          plan.early_return, NULL, 0, NULL, log_3, intermediate);
        if (!instance && (plan.event_mode || plan.early_return)) {
            plan.event_mode = plan.early_return = false;
            instance = ((Fn)find("InstantiateCoSimulation"))("it", plan.guid, resource_path(), false, false, false, false, NULL, 0,
                                                              NULL, log_3, intermediate);
        }
    }
    if (!instance)
        end("no instance");
}

static void instantiate_equations(void) {
    if (plan.version == 1) {
        Callbacks1 own = {log_2, calloc, free, NULL};
        typedef void *(*Fn)(const char *, const char *, Callbacks1, char);
        instance = ((Fn)find("InstantiateModel"))("it", plan.guid, own, 0);
    } else if (plan.version == 2) {
        static Callbacks2 own = {log_2, calloc, free, NULL, NULL};
        typedef void *(*Fn)(const char *, int, const char *, const char *, const Callbacks2 *, int, int);
        instance = ((Fn)find("Instantiate"))("it", 0, plan.guid, plan.resources, &own, 0, 0);
    } else {
        typedef void *(*Fn)(const char *, const char *, const char *, bool, bool, void *, void (*)(void *, int, const char *, const char *));
        instance = ((Fn)find("InstantiateModelExchange"))("it", plan.guid, resource_path(), false, false, NULL, log_3);
    }
    if (!instance)
        end("no instance");
}

typedef int (*ComponentFn)(void *);

static void call(const char *name) { must(name, ((ComponentFn)find(name))(instance)); }

static void update(void) {
    typedef int (*Fn)(void *, bool *, bool *, bool *, bool *, bool *, double *);
    for (int i = 0; i < MOST_UPDATES; i++) {
        bool again = false, terminate = false, nominals = false, states = false;
        has_next_event = false;
        must("UpdateDiscreteStates",
             ((Fn)find("UpdateDiscreteStates"))(instance, &again, &terminate, &nominals, &states, &has_next_event, &next_event));
        if (!again)
            return;
    }
    end("updates without end");
}

/* fmiEventInfo of FMI 1.0 and fmi2EventInfo. */
typedef struct {
    char iterated, references_changed, nominals_changed, terminate, has_next;
    double next;
} EventInfo1;

typedef struct {
    int again, terminate, nominals_changed, values_changed, has_next;
    double next;
} EventInfo2;

static void update_equations(void) {
    if (plan.version == 3) {
        update();
        return;
    }
    typedef int (*Fn)(void *, EventInfo2 *);
    for (int i = 0; i < MOST_UPDATES; i++) {
        EventInfo2 info = {0};
        must("NewDiscreteStates", ((Fn)find("NewDiscreteStates"))(instance, &info));
        has_next_event = info.has_next, next_event = info.next;
        if (!info.again)
            return;
    }
    end("updates without end");
}

static void numbers(const char *name, double *own, size_t count) {
    typedef int (*Fn)(void *, double *, size_t);
    if (count)
        must(name, ((Fn)find(name))(instance, own, count));
}

static void set_time(double time) {
    typedef int (*Fn)(void *, double);
    must("SetTime", ((Fn)find("SetTime"))(instance, time));
}

static void derivatives(double time, double *states, double *own) {
    set_time(time);
    numbers("SetContinuousStates", states, plan.states);
    numbers(plan.version == 3 ? "GetContinuousStateDerivatives" : "GetDerivatives", own, plan.states);
}

/* Whether the FMU asks for an event after a step of the integrator. */
static bool completed_step(void) {
    if (plan.version == 1) {
        char event = 0;
        typedef int (*Fn)(void *, char *);
        must("CompletedIntegratorStep", ((Fn)find("CompletedIntegratorStep"))(instance, &event));
        return event;
    }
    if (plan.version == 2) {
        int event = 0, terminate = 0;
        typedef int (*Fn)(void *, int, int *, int *);
        must("CompletedIntegratorStep", ((Fn)find("CompletedIntegratorStep"))(instance, 1, &event, &terminate));
        return event;
    }
    bool event = false, terminate = false;
    typedef int (*Fn)(void *, bool, bool *, bool *);
    must("CompletedIntegratorStep", ((Fn)find("CompletedIntegratorStep"))(instance, true, &event, &terminate));
    return event;
}

static void start_equations(void) {
    if (plan.version == 1) {
        typedef int (*Fn)(void *, char, double, EventInfo1 *);
        EventInfo1 info = {0};
        set_time(plan.start);
        must("Initialize", ((Fn)find("Initialize"))(instance, plan.tolerance > 0.0, plan.tolerance, &info));
        has_next_event = info.has_next, next_event = info.next;
        return;
    }
    update_equations();
    call("EnterContinuousTimeMode");
    if (plan.version == 3) {
        typedef int (*Fn)(void *, size_t *);
        must("GetNumberOfContinuousStates", ((Fn)find("GetNumberOfContinuousStates"))(instance, &plan.states));
        must("GetNumberOfEventIndicators", ((Fn)find("GetNumberOfEventIndicators"))(instance, &plan.indicators));
    }
}

static double *vector(size_t count) { return calloc(count + 1, sizeof(double)); }

static void integrate(void) {
    size_t n = plan.states;
    double *x = vector(n), *at = vector(n), *k[4] = {vector(n), vector(n), vector(n), vector(n)};
    double *before = vector(plan.indicators), *after = vector(plan.indicators);
    numbers("GetContinuousStates", x, n);
    numbers("GetEventIndicators", before, plan.indicators);
    double h = plan.step / (double)plan.integrator_steps;
    for (long i = 0; i < plan.steps * plan.integrator_steps; i++) {
        double time = plan.start + (double)i * h;
        if (has_next_event && next_event <= time + h * (1.0 + SAME))
            end("at an event");
        for (int stage = 0; stage < 4; stage++) {
            double share = stage == 0 ? 0.0 : stage == 3 ? h : h / 2.0;
            for (size_t j = 0; j < n; j++)
                at[j] = x[j] + (stage ? share * k[stage - 1][j] : 0.0);
            derivatives(time + share, at, k[stage]);
        }
        for (size_t j = 0; j < n; j++)
            x[j] += h / 6.0 * (k[0][j] + 2.0 * k[1][j] + 2.0 * k[2][j] + k[3][j]);
        set_time(time + h);
        numbers("SetContinuousStates", x, n);
        numbers("GetEventIndicators", after, plan.indicators);
        for (size_t j = 0; j < plan.indicators; j++)
            if ((before[j] > 0.0) != (after[j] > 0.0))
                end("at an event");
        if (completed_step())
            end("at an event");
        if ((i + 1) % plan.integrator_steps == 0)
            write_row(time + h);
    }
}

static void initialize(void) {
    bool relative = plan.tolerance > 0.0;
    if (plan.version == 1 && plan.integrator_steps)
        return;
    if (plan.version == 1) {
        typedef int (*Fn)(void *, double, char, double);
        must("InitializeSlave", ((Fn)find("InitializeSlave"))(instance, plan.start, 1, plan.stop));
        return;
    }
    if (plan.version == 2) {
        typedef int (*Fn)(void *, int, double, double, int, double);
        must("SetupExperiment",
             ((Fn)find("SetupExperiment"))(instance, relative, relative ? plan.tolerance : 0.0, plan.start, 1, plan.stop));
        call("EnterInitializationMode");
    } else {
        typedef int (*Fn)(void *, bool, double, double, bool, double);
        must("EnterInitializationMode", ((Fn)find("EnterInitializationMode"))(instance, relative, relative ? plan.tolerance : 0.0,
                                                                              plan.start, true, plan.stop));
    }
    call("ExitInitializationMode");
    if (plan.event_mode && !plan.integrator_steps) {
        update();
        call("EnterStepMode");
    }
}

/* Whether it goes on. */
static bool advance(double from, double length, double *reached, bool *event) {
    *reached = from + length;
    *event = false;
    int status;
    if (plan.version == 1) {
        typedef int (*Fn)(void *, double, double, char);
        status = ((Fn)find("DoStep"))(instance, from, length, 1);
    } else if (plan.version == 2) {
        typedef int (*Fn)(void *, double, double, int);
        status = ((Fn)find("DoStep"))(instance, from, length, 1);
    } else {
        bool terminate = false, early = false;
        double last = *reached;
        typedef int (*Fn)(void *, double, double, bool, bool *, bool *, bool *, double *);
        status = ((Fn)find("DoStep"))(instance, from, length, true, event, &terminate, &early, &last);
        if (early)
            *reached = last;
        if (status <= DISCARD && terminate)
            return false;
    }
    if (status == DISCARD && plan.version == 2) {
        enum { TERMINATED = 3 };
        typedef int (*Fn)(void *, int, int *);
        int terminated = 0;
        if (((Fn)find("GetBooleanStatus"))(instance, TERMINATED, &terminated) <= WARNING && terminated)
            return false;
    }
    must("DoStep", status);
    return true;
}

static bool step(double begin) {
    double time = begin, last = begin + plan.step, slack = SAME * plan.step;
    for (;;) {
        bool divided = plan.event_mode && plan.variable_step && has_next_event && next_event > time + slack && next_event < last - slack;
        double to = divided ? next_event : last, reached;
        bool event;
        if (!advance(time, time == begin && !divided ? plan.step : to - time, &reached, &event))
            return false;
        if (plan.event_mode && (event || (has_next_event && next_event <= reached + slack))) {
            call("EnterEventMode");
            update();
            call("EnterStepMode");
        }
        bool early = reached < to - slack;
        if (!early && !divided)
            return true;
        time = early ? reached : to;
    }
}

static void read_plan(const char *path) {
    FILE *file = fopen(path, "r");
    char line[8192];
    while (file && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\r\n")] = 0;
        char *value = strchr(line, ' ');
        if (!value)
            continue;
        *value++ = 0;
        if (!strcmp(line, "version")) plan.version = atoi(value);
        else if (!strcmp(line, "identifier")) snprintf(plan.identifier, sizeof plan.identifier, "%s", value);
        else if (!strcmp(line, "guid")) snprintf(plan.guid, sizeof plan.guid, "%s", value);
        else if (!strcmp(line, "resources")) snprintf(plan.resources, sizeof plan.resources, "%s", value);
        else if (!strcmp(line, "start")) plan.start = strtod(value, NULL);
        else if (!strcmp(line, "step")) plan.step = strtod(value, NULL);
        else if (!strcmp(line, "steps")) plan.steps = atol(value);
        else if (!strcmp(line, "tolerance")) plan.tolerance = strtod(value, NULL);
        else if (!strcmp(line, "integrator_steps")) plan.integrator_steps = atol(value);
        else if (!strcmp(line, "states")) plan.states = strtoul(value, NULL, 10);
        else if (!strcmp(line, "indicators")) plan.indicators = strtoul(value, NULL, 10);
        else if (!strcmp(line, "event_mode")) plan.event_mode = *value == '1';
        else if (!strcmp(line, "early_return")) plan.early_return = *value == '1';
        else if (!strcmp(line, "variable_step")) plan.variable_step = *value == '1';
        else if (!strcmp(line, "get") && variable_count < MOST_VARIABLES) {
            Variable *it = &variables[variable_count++];
            unsigned long count, reference;
            sscanf(value, "%15s %lu %lu", it->type, &count, &reference);
            it->count = count, it->reference = (uint32_t)reference;
        }
    }
    if (file)
        fclose(file);
}

static void load(char *path) {
#ifdef _WIN32
    SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX | SEM_NOOPENFILEERRORBOX);
    library = LoadLibraryExA(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
    if (!library) {
        char what[64];
        snprintf(what, sizeof what, "no library: error %lu", GetLastError());
        end(what);
    }
#else
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        char what[1024];
        snprintf(what, sizeof what, "no library: %s", dlerror());
        end(what);
    }
#endif
}

int main(int count, char **words) {
    if (count != 4)
        return 2;
    read_plan(words[2]);
    values = fopen(words[3], "w");
    if (!values)
        return 2;
    plan.stop = plan.start + (double)(plan.steps - 1) * plan.step + plan.step;
    load(words[1]);
    if (plan.integrator_steps)
        instantiate_equations();
    else
        instantiate();
    initialize();
    if (plan.integrator_steps)
        start_equations();
    write_row(plan.start);
    if (plan.integrator_steps) {
        integrate();
        end("well");
    }
    for (long i = 0; i < plan.steps; i++) {
        if (!step(plan.start + (double)i * plan.step)) {
            end("of its own accord");
        }
        write_row(plan.start + (double)(i + 1) * plan.step);
    }
    end("well");
    return 0;
}
