/* Runs under Wine: loads an FMU's library for Windows, and makes the calls that the other process writes into shared memory.

   Its argument is the path of that memory. `binding/windows/memory.rs` has the same layout, `binding/windows/forwarding.rs` the same
   arguments for each function. */
#define __USE_MINGW_ANSI_STDIO 1
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { INTEGERS = 8, REALS = 4, ARRAYS = 8, LOG = 1 << 18, GUARD = 64, LONGEST_TEXT = 4096 };

/* Fields of fixed width, so that 32 and 64 bits agree; what both sides write at once has a line of the cache for itself. */
struct shared {
    volatile uint32_t turn; /* odd for this process */
    uint32_t gap0[15];
    volatile uint32_t asleep;
    uint32_t gap1[15];
    volatile uint32_t exception; /* the code of the last one in this call */
    volatile uint32_t unhandled;
    volatile uint64_t exception_address;
    uint32_t gap2[12];
    volatile uint64_t log_written; /* bytes in all */
    uint64_t gap3[7];
    volatile uint64_t log_read;
    uint64_t gap4[7];
    uint32_t row;
    int32_t status;
    uint64_t result;
    uint64_t size; /* of the whole memory [bytes] */
    uint64_t integers[INTEGERS];
    double reals[REALS];
    struct {
        uint64_t offset, length;
    } arrays[ARRAYS];
    uint8_t gap5[3528];
    uint8_t log[LOG];
    uint8_t data[];
};
_Static_assert(offsetof(struct shared, row) == 320 && offsetof(struct shared, log) == 4096, "the layout of memory.rs");

/* Rows that are no function of the FMU. */
enum { LOAD = 0x10000, QUIT };
/* Statuses of this program: the texts do not fit, the row is unknown. */
enum { TOO_LARGE = 0x10000, UNKNOWN };

static struct shared *shared;
static HMODULE library;
static const char *memory_path;
static CRITICAL_SECTION log_lock;
static volatile LONG in_call;

static void end(UINT code) {
    TerminateProcess(GetCurrentProcess(), code);
}

/* Messages. A record is a head, a category and a text. */

struct record {
    uint32_t length; /* with the head, a multiple of 8 */
    int32_t status;
    uint64_t environment;
    uint32_t category, text, whole, gap;
};

static uint64_t put_log(uint64_t at, const void *bytes, size_t count) {
    for (size_t i = 0; i < count; i++) shared->log[(at + i) % LOG] = ((const uint8_t *)bytes)[i];
    return at + count;
}

static void send_message(void *environment, int status, const char *category, const char *text, size_t whole) {
    struct record record;
    size_t names = category ? strlen(category) : 0, words = text ? strlen(text) : 0;
    if (names > LONGEST_TEXT) names = LONGEST_TEXT;
    if (words > LONGEST_TEXT) words = LONGEST_TEXT;
    memset(&record, 0, sizeof record);
    record.length = (uint32_t)((sizeof record + names + words + 7) & ~(size_t)7);
    record.status = status;
    record.environment = (uintptr_t)environment;
    record.category = (uint32_t)names;
    record.text = (uint32_t)words;
    record.whole = (uint32_t)whole;
    EnterCriticalSection(&log_lock);
    /* The other side reads while it waits for a call, and not before the next one otherwise: then a full log loses the message. */
    while (in_call && shared->log_written + record.length - shared->log_read > LOG) Sleep(1);
    if (shared->log_written + record.length - shared->log_read <= LOG) {
        uint64_t at = put_log(shared->log_written, &record, sizeof record);
        at = put_log(at, category, names);
        put_log(at, text, words);
        MemoryBarrier();
        shared->log_written += record.length;
    }
    LeaveCriticalSection(&log_lock);
}

static void log_fmi2(void *environment, const char *instance, int status, const char *category, const char *format, ...) {
    char text[LONGEST_TEXT + 1];
    va_list arguments;
    int length;
    (void)instance;
    va_start(arguments, format);
    length = format ? vsnprintf(text, sizeof text, format, arguments) : -1;
    va_end(arguments);
    if (length < 0) text[length = 0] = '\0';
    send_message(environment, status, category, text, (size_t)length);
}

static void log_fmi3(void *environment, int status, const char *category, const char *text) {
    send_message(environment, status, category, text, 0);
}

static void intermediate_update(void *environment, double time, bool set, bool get, bool finished, bool early,
                                bool *early_return_requested, double *early_return_time) {
    (void)environment, (void)set, (void)get, (void)finished, (void)early;
    if (early_return_requested) *early_return_requested = false;
    if (early_return_time) *early_return_time = time;
}

/* Crashes. What the library handles itself is no crash, so the first handler only takes a note. */

static void take_note(const EXCEPTION_RECORD *found) {
    shared->exception = found->ExceptionCode;
    shared->exception_address = (uintptr_t)found->ExceptionAddress;
}

static LONG CALLBACK note_exception(EXCEPTION_POINTERS *found) {
    /* Others are messages for debuggers. */
    if (found->ExceptionRecord->ExceptionCode >> 30 == 3) take_note(found->ExceptionRecord);
    return EXCEPTION_CONTINUE_SEARCH;
}

static LONG CALLBACK end_by_exception(EXCEPTION_POINTERS *found) {
    take_note(found->ExceptionRecord);
    shared->unhandled = 1;
    end(1);
    return EXCEPTION_CONTINUE_SEARCH;
}

/* The other process has this memory open as long as it lives, in whatever way it ends. */
static DWORD CALLBACK watch_other_process(void *unused) {
    (void)unused;
    while (GetFileAttributesA(memory_path) != INVALID_FILE_ATTRIBUTES) Sleep(250);
    end(0);
    return 0;
}

/* Arguments of the call. */

static void *array(int place) {
    uint64_t offset = shared->arrays[place].offset;
    return offset ? (uint8_t *)shared + offset : NULL;
}
static size_t length(int place) {
    return (size_t)shared->arrays[place].length;
}
#define integer(place) ((size_t)shared->integers[place])
#define real(place) (shared->reals[place])
#define pointer(place) ((void *)(uintptr_t)shared->integers[place])

/* An array of offsets becomes one of pointers in its place; they are not longer. */
static void **pointers(int place) {
    uint64_t *offsets = array(place);
    void **found = (void **)offsets;
    size_t count = length(place) / sizeof *offsets;
    for (size_t i = 0; i < count; i++) {
        uint64_t offset = offsets[i];
        found[i] = offset ? (uint8_t *)shared + offset : NULL;
    }
    return found;
}

/* Puts what the pointers of an array are the addresses of behind all else: a length and the bytes; -1 stands for null. Texts have no sizes. */
static int pack(int place, size_t count, const size_t *sizes) {
    void **from = array(place);
    uint64_t at = shared->result;
    for (size_t i = 0; i < count; i++) {
        size_t bytes = !from[i] ? 0 : sizes ? sizes[i] : strlen(from[i]);
        if (bytes > shared->size || at + sizeof(uint64_t) + bytes + 8 > shared->size) return TOO_LARGE;
        uint64_t stated = from[i] ? bytes : UINT64_MAX;
        memcpy((uint8_t *)shared + at, &stated, sizeof stated);
        if (bytes) memcpy((uint8_t *)shared + at + sizeof stated, from[i], bytes);
        at = (at + sizeof stated + bytes + 7) & ~(uint64_t)7;
    }
    return 0;
}

/* The functions of FMI by what they take: `c` is the instance, the first integer. */

enum shape {
    TEXT, COMPONENT, FREE, GET_STATE, SET_STATE, FREE_STATE, STATE_SIZE, SERIALIZE, DESERIALIZE,
    LOGGING2, LOGGING3, INSTANTIATE2, CO_SIMULATION3, MODEL_EXCHANGE3, EXPERIMENT, INITIALIZATION3,
    VALUES2, VALUES3, GET_TEXTS2, SET_TEXTS2, GET_TEXTS3, SET_TEXTS3, GET_BINARIES, SET_BINARIES,
    DERIVATIVE2, DERIVATIVE3, ORDERS2, ORDERS3, STEP2, STEP3, STATUS, TIME, STATES, EVENT_INFO,
    COMPLETED2, COMPLETED3, UPDATE
};

static const struct {
    const char *name;
    enum shape shape;
} FUNCTIONS[] = {
    {"fmi2GetVersion", TEXT}, {"fmi2GetTypesPlatform", TEXT}, {"fmi3GetVersion", TEXT},
    {"fmi2FreeInstance", FREE}, {"fmi3FreeInstance", FREE},
    {"fmi2EnterInitializationMode", COMPONENT}, {"fmi2ExitInitializationMode", COMPONENT},
    {"fmi3ExitInitializationMode", COMPONENT}, {"fmi2Terminate", COMPONENT}, {"fmi3Terminate", COMPONENT},
    {"fmi2Reset", COMPONENT}, {"fmi3Reset", COMPONENT}, {"fmi2CancelStep", COMPONENT},
    {"fmi2EnterEventMode", COMPONENT}, {"fmi3EnterEventMode", COMPONENT}, {"fmi3EnterStepMode", COMPONENT},
    {"fmi2EnterContinuousTimeMode", COMPONENT}, {"fmi3EnterContinuousTimeMode", COMPONENT},
    {"fmi3EnterConfigurationMode", COMPONENT}, {"fmi3ExitConfigurationMode", COMPONENT},
    {"fmi2GetFMUstate", GET_STATE}, {"fmi3GetFMUState", GET_STATE}, {"fmi2SetFMUstate", SET_STATE},
    {"fmi3SetFMUState", SET_STATE}, {"fmi2FreeFMUstate", FREE_STATE}, {"fmi3FreeFMUState", FREE_STATE},
    {"fmi2SerializedFMUstateSize", STATE_SIZE}, {"fmi3SerializedFMUStateSize", STATE_SIZE},
    {"fmi2SerializeFMUstate", SERIALIZE}, {"fmi3SerializeFMUState", SERIALIZE},
    {"fmi2DeSerializeFMUstate", DESERIALIZE}, {"fmi3DeserializeFMUState", DESERIALIZE},
    {"fmi2SetDebugLogging", LOGGING2}, {"fmi3SetDebugLogging", LOGGING3},
    {"fmi2Instantiate", INSTANTIATE2}, {"fmi3InstantiateCoSimulation", CO_SIMULATION3},
    {"fmi3InstantiateModelExchange", MODEL_EXCHANGE3}, {"fmi2SetupExperiment", EXPERIMENT},
    {"fmi3EnterInitializationMode", INITIALIZATION3},
    {"fmi2GetReal", VALUES2}, {"fmi2GetInteger", VALUES2}, {"fmi2GetBoolean", VALUES2}, {"fmi2SetReal", VALUES2},
    {"fmi2SetInteger", VALUES2}, {"fmi2SetBoolean", VALUES2}, {"fmi3GetClock", VALUES2}, {"fmi3SetClock", VALUES2},
    {"fmi3GetShiftDecimal", VALUES2}, {"fmi2GetString", GET_TEXTS2}, {"fmi2SetString", SET_TEXTS2},
    {"fmi3GetFloat32", VALUES3}, {"fmi3GetFloat64", VALUES3}, {"fmi3GetInt8", VALUES3}, {"fmi3GetUInt8", VALUES3},
    {"fmi3GetInt16", VALUES3}, {"fmi3GetUInt16", VALUES3}, {"fmi3GetInt32", VALUES3}, {"fmi3GetUInt32", VALUES3},
    {"fmi3GetInt64", VALUES3}, {"fmi3GetUInt64", VALUES3}, {"fmi3GetBoolean", VALUES3},
    {"fmi3SetFloat32", VALUES3}, {"fmi3SetFloat64", VALUES3}, {"fmi3SetInt8", VALUES3}, {"fmi3SetUInt8", VALUES3},
    {"fmi3SetInt16", VALUES3}, {"fmi3SetUInt16", VALUES3}, {"fmi3SetInt32", VALUES3}, {"fmi3SetUInt32", VALUES3},
    {"fmi3SetInt64", VALUES3}, {"fmi3SetUInt64", VALUES3}, {"fmi3SetBoolean", VALUES3},
    {"fmi3GetString", GET_TEXTS3}, {"fmi3SetString", SET_TEXTS3}, {"fmi3GetBinary", GET_BINARIES},
    {"fmi3SetBinary", SET_BINARIES},
    {"fmi2GetDirectionalDerivative", DERIVATIVE2}, {"fmi3GetDirectionalDerivative", DERIVATIVE3},
    {"fmi3GetAdjointDerivative", DERIVATIVE3}, {"fmi2SetRealInputDerivatives", ORDERS2},
    {"fmi2GetRealOutputDerivatives", ORDERS2}, {"fmi3GetIntervalDecimal", ORDERS2},
    {"fmi3GetOutputDerivatives", ORDERS3}, {"fmi2DoStep", STEP2}, {"fmi3DoStep", STEP3},
    {"fmi2GetStatus", STATUS}, {"fmi2GetRealStatus", STATUS}, {"fmi2GetBooleanStatus", STATUS},
    {"fmi2SetTime", TIME}, {"fmi3SetTime", TIME}, {"fmi2SetContinuousStates", STATES},
    {"fmi3SetContinuousStates", STATES}, {"fmi2GetContinuousStates", STATES}, {"fmi3GetContinuousStates", STATES},
    {"fmi2GetDerivatives", STATES}, {"fmi3GetContinuousStateDerivatives", STATES}, {"fmi2GetEventIndicators", STATES},
    {"fmi3GetEventIndicators", STATES}, {"fmi2GetNominalsOfContinuousStates", STATES},
    {"fmi3GetNominalsOfContinuousStates", STATES}, {"fmi2NewDiscreteStates", EVENT_INFO},
    {"fmi2CompletedIntegratorStep", COMPLETED2}, {"fmi3CompletedIntegratorStep", COMPLETED3},
    {"fmi3UpdateDiscreteStates", UPDATE},
};
enum { COUNT = sizeof FUNCTIONS / sizeof FUNCTIONS[0] };

typedef void any_function(void);
enum { ROWS = 256 };

/* The functions by the rows of the other side. */
static struct {
    any_function *function;
    enum shape shape;
} rows[ROWS];

struct callbacks {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
};

static void *instantiate_fmi2(any_function *function) {
    /* The instance keeps them, and may use them until this process ends. */
    struct callbacks *callbacks = malloc(sizeof *callbacks);
    if (!callbacks) return NULL;
    *callbacks = (struct callbacks){log_fmi2, calloc, free, NULL, pointer(0)};
    return ((void *(*)(const char *, int, const char *, const char *, const struct callbacks *, int, int))function)(
        array(0), (int)integer(1), array(1), array(2), callbacks, (int)integer(2), (int)integer(3));
}

/* Declares the type of a function and calls it. */
#define CALL(result, types, ...) (((result(*) types)function)(__VA_ARGS__))
#define C pointer(0)
#define REFERENCES array(0), length(0) / sizeof(uint32_t)
#define WITH_REFERENCES void *, void *, size_t

static int call(any_function *function, enum shape shape) {
    void *state = pointer(1);
    size_t size = 0;
    int status = 0;
    switch (shape) {
    case TEXT: {
        const char *text = CALL(const char *, (void));
        snprintf(array(0), length(0), "%s", text ? text : "");
        return 0;
    }
    case COMPONENT: return CALL(int, (void *), C);
    case FREE: CALL(void, (void *), C); return 0;
    case GET_STATE:
        status = CALL(int, (void *, void **), C, &state);
        shared->result = (uintptr_t)state;
        return status;
    case SET_STATE: return CALL(int, (void *, void *), C, state);
    case FREE_STATE:
        status = CALL(int, (void *, void **), C, &state);
        shared->result = (uintptr_t)state;
        return status;
    case STATE_SIZE:
        status = CALL(int, (void *, void *, size_t *), C, state, &size);
        shared->result = size;
        return status;
    case SERIALIZE: return CALL(int, (void *, void *, void *, size_t), C, state, array(0), length(0));
    case DESERIALIZE:
        status = CALL(int, (void *, void *, size_t, void **), C, array(0), length(0), &state);
        shared->result = (uintptr_t)state;
        return status;
    case LOGGING2: return CALL(int, (void *, int, size_t, void **), C, (int)integer(1), length(0) / 8, pointers(0));
    case LOGGING3: return CALL(int, (void *, bool, size_t, void **), C, integer(1) != 0, length(0) / 8, pointers(0));
    case INSTANTIATE2: shared->result = (uintptr_t)instantiate_fmi2(function); return 0;
    case CO_SIMULATION3:
        shared->result = (uintptr_t)CALL(
            void *, (void *, void *, void *, bool, bool, bool, bool, void *, size_t, void *, void *, void *), array(0), array(1),
            array(2), integer(1) != 0, integer(2) != 0, integer(3) != 0, integer(4) != 0, NULL, 0, C, log_fmi3, intermediate_update);
        return 0;
    case MODEL_EXCHANGE3:
        shared->result = (uintptr_t)CALL(void *, (void *, void *, void *, bool, bool, void *, void *), array(0), array(1), array(2),
                                         integer(1) != 0, integer(2) != 0, C, log_fmi3);
        return 0;
    case EXPERIMENT:
        return CALL(int, (void *, int, double, double, int, double), C, (int)integer(1), real(0), real(1), (int)integer(2), real(2));
    case INITIALIZATION3:
        return CALL(int, (void *, bool, double, double, bool, double), C, integer(1) != 0, real(0), real(1), integer(2) != 0, real(2));
    case VALUES2: return CALL(int, (WITH_REFERENCES, void *), C, REFERENCES, array(1));
    case VALUES3: return CALL(int, (WITH_REFERENCES, void *, size_t), C, REFERENCES, array(1), integer(1));
    case GET_TEXTS2:
        status = CALL(int, (WITH_REFERENCES, void *), C, REFERENCES, array(1));
        return status > 1 || !pack(1, integer(1), NULL) ? status : TOO_LARGE;
    case GET_TEXTS3:
        status = CALL(int, (WITH_REFERENCES, void *, size_t), C, REFERENCES, array(1), integer(1));
        return status > 1 || !pack(1, integer(1), NULL) ? status : TOO_LARGE;
    case SET_TEXTS2: return CALL(int, (WITH_REFERENCES, void **), C, REFERENCES, pointers(1));
    case SET_TEXTS3: return CALL(int, (WITH_REFERENCES, void **, size_t), C, REFERENCES, pointers(1), integer(1));
    case GET_BINARIES:
        status = CALL(int, (WITH_REFERENCES, size_t *, void *, size_t), C, REFERENCES, array(2), array(1), integer(1));
        return status > 1 || !pack(1, integer(1), array(2)) ? status : TOO_LARGE;
    case SET_BINARIES:
        return CALL(int, (WITH_REFERENCES, size_t *, void **, size_t), C, REFERENCES, array(2), pointers(1), integer(1));
    case DERIVATIVE2:
        return CALL(int, (WITH_REFERENCES, void *, size_t, void *, void *), C, REFERENCES, array(1), length(1) / 4, array(2), array(3));
    case DERIVATIVE3:
        return CALL(int, (WITH_REFERENCES, void *, size_t, void *, size_t, void *, size_t), C, REFERENCES, array(1), length(1) / 4,
                    array(2), integer(1), array(3), integer(2));
    case ORDERS2: return CALL(int, (WITH_REFERENCES, void *, void *), C, REFERENCES, array(1), array(2));
    case ORDERS3: return CALL(int, (WITH_REFERENCES, void *, void *, size_t), C, REFERENCES, array(1), array(2), integer(1));
    case STEP2: return CALL(int, (void *, double, double, int), C, real(0), real(1), (int)integer(1));
    case STEP3:
        return CALL(int, (void *, double, double, bool, void *, void *, void *, void *), C, real(0), real(1), integer(1) != 0, array(0),
                    array(1), array(2), array(3));
    case STATUS: return CALL(int, (void *, int, void *), C, (int)integer(1), array(0));
    case TIME: return CALL(int, (void *, double), C, real(0));
    case STATES: return CALL(int, (void *, void *, size_t), C, array(0), integer(1));
    case EVENT_INFO: return CALL(int, (void *, void *), C, array(0));
    case COMPLETED2: return CALL(int, (void *, int, void *, void *), C, (int)integer(1), array(0), array(1));
    case COMPLETED3: return CALL(int, (void *, bool, void *, void *), C, integer(1) != 0, array(0), array(1));
    case UPDATE:
        return CALL(int, (void *, void *, void *, void *, void *, void *, void *), C, array(0), array(1), array(2), array(3), array(4),
                    array(5));
    }
    return UNKNOWN;
}

/* The names of functions give them their rows; a byte for each says whether the library has it. */
static void bind(const char *names, uint8_t *there) {
    for (int row = 0; *names && row < ROWS; row++, names += strlen(names) + 1) {
        any_function *function = (any_function *)GetProcAddress(library, names);
        there[row] = function != NULL;
        for (int i = 0; i < COUNT; i++) {
            if (strcmp(FUNCTIONS[i].name, names) != 0) continue;
            rows[row].shape = FUNCTIONS[i].shape;
            rows[row].function = function;
        }
    }
}

/* Loads the library by its path, with its folder searched for those that it loads later; the error of Windows is the result. */
static int load(void) {
    wchar_t path[4096], folder[4096];
    if (!MultiByteToWideChar(CP_UTF8, 0, array(0), -1, path, 4096)) return UNKNOWN;
    if (!MultiByteToWideChar(CP_UTF8, 0, array(1), -1, folder, 4096)) return UNKNOWN;
    SetDllDirectoryW(folder);
    /* The one beside this program: for a library, Windows looks beside that library only. */
    LoadLibraryW(L"bcryptprimitives.dll");
    library = LoadLibraryExW(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
    shared->result = library ? 0 : GetLastError();
    if (library) bind(array(2), array(3));
    return 0;
}

static int answer(void) {
    switch (shared->row) {
    case LOAD: return load();
    case QUIT: return library ? !FreeLibrary(library) : 0;
    default:
        if (shared->row >= ROWS || !rows[shared->row].function) return UNKNOWN;
        return call(rows[shared->row].function, rows[shared->row].shape);
    }
}

/* Whoever waits longer than this sleeps, since others need the processor [us]. */
enum { AWAKE = 60 };

static void await_turn(void) {
    LARGE_INTEGER begin, now, second;
    QueryPerformanceFrequency(&second);
    QueryPerformanceCounter(&begin);
    for (;;) {
        for (int i = 0; i < 100; i++) {
            if (shared->turn & 1) return;
            YieldProcessor();
        }
        SwitchToThread();
        QueryPerformanceCounter(&now);
        if ((now.QuadPart - begin.QuadPart) * 1000000 > AWAKE * second.QuadPart) break;
    }
    for (;;) {
        char byte;
        DWORD count = 0;
        shared->asleep = 1;
        MemoryBarrier();
        if (!(shared->turn & 1) && (!ReadFile(GetStdHandle(STD_INPUT_HANDLE), &byte, 1, &count, NULL) || count == 0)) end(0);
        shared->asleep = 0;
        if (shared->turn & 1) return;
    }
}

/* What the library prints goes nowhere: the terminal is the other program's. */
static void silence(void) {
    HANDLE nowhere = CreateFileW(L"NUL", GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE, NULL, OPEN_EXISTING, 0, NULL);
    SetStdHandle(STD_OUTPUT_HANDLE, nowhere);
    SetStdHandle(STD_ERROR_HANDLE, nowhere);
    freopen("NUL", "w", stdout);
    freopen("NUL", "w", stderr);
}

int main(int count, char **arguments) {
    if (count != 2) return 2;
    memory_path = arguments[1];
    HANDLE file = CreateFileA(memory_path, GENERIC_READ | GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                              OPEN_EXISTING, 0, NULL);
    HANDLE mapping = file == INVALID_HANDLE_VALUE ? NULL : CreateFileMappingW(file, NULL, PAGE_READWRITE, 0, 0, NULL);
    shared = mapping ? MapViewOfFile(mapping, FILE_MAP_ALL_ACCESS, 0, 0, 0) : NULL;
    if (!shared) {
        fprintf(stderr, "the shared memory cannot be mapped: Windows error %lu\n", GetLastError());
        return 3;
    }
    silence();
    SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX | SEM_NOALIGNMENTFAULTEXCEPT | SEM_NOOPENFILEERRORBOX);
    InitializeCriticalSection(&log_lock);
    ULONG room = 1 << 16;
    SetThreadStackGuarantee(&room);
    AddVectoredExceptionHandler(1, note_exception);
    SetUnhandledExceptionFilter(end_by_exception);
    CloseHandle(CreateThread(NULL, 0, watch_other_process, NULL, 0, NULL));
    /* Ready. */
    shared->turn++;
    for (;;) {
        await_turn();
        in_call = 1;
        shared->exception = 0;
        shared->status = answer();
        in_call = 0;
        MemoryBarrier();
        uint32_t row = shared->row;
        shared->turn++;
        if (row == QUIT) end(0);
    }
}
