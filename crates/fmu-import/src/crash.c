/* Says which call of which FMU the process dies in: by a signal, or because the FMU calls exit. */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The layout is that of `Activity` in binding/activity.rs. */
typedef struct {
    const char *node;
    const char *call;
    double time;
} Activity;

/* The exit code of a run whose FMU failed. */
enum { FMU_FAILED = 3 };

static const int SIGNALS[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
enum { COUNT = sizeof SIGNALS / sizeof SIGNALS[0] };
static struct sigaction before[COUNT];

static __thread const Activity *current;

void trackside_enter(const Activity *activity) { current = activity; }

/* A handler may not call printf, nor anything else that allocates or locks. */
static void put(const char *text) {
    ssize_t written = write(STDERR_FILENO, text, strlen(text));
    (void)written;
}

/* Writes a time [s] to the microsecond, without the zeros at its end. */
static void put_time(double time) {
    char digits[32], *at = digits + sizeof digits - 1;
    long long rest = (long long)(time * 1e6 + (time < 0 ? -0.5 : 0.5));
    int negative = rest < 0, shown = 0;
    if (negative) rest = -rest;
    *at = '\0';
    for (int place = 0; place < 6; place++, rest /= 10) {
        shown |= rest % 10 != 0;
        if (shown) *--at = (char)('0' + rest % 10);
    }
    if (shown) *--at = '.';
    do *--at = (char)('0' + rest % 10);
    while (rest /= 10);
    if (negative) *--at = '-';
    put(at);
}

static void tell(const Activity *activity, const char *what) {
    put("\nnode `");
    put(activity->node);
    put("`: ");
    put(activity->call);
    /* Before the experiment is set up there is no time, which is NaN. */
    if (activity->time == activity->time) {
        put(" at t = ");
        put_time(activity->time);
        put(" s");
    }
    put(" ended this program: the FMU ");
    put(what);
    put("\n");
}

static const char *meaning(int signal) {
    switch (signal) {
    case SIGSEGV: return "touched memory that is not its own (SIGSEGV)";
    case SIGBUS: return "touched memory that is not there (SIGBUS)";
    case SIGFPE: return "did integer arithmetic without a result (SIGFPE)";
    case SIGILL: return "ran into what is no instruction (SIGILL)";
    default: return "aborted (SIGABRT)";
    }
}

/* Afterwards the signal takes its usual course: it comes again, or it is sent again. */
static void handle(int signal, siginfo_t *info, void *context) {
    (void)context;
    if (current) tell(current, meaning(signal));
    for (int i = 0; i < COUNT; i++)
        if (SIGNALS[i] == signal) sigaction(signal, &before[i], NULL);
    if (info->si_code <= 0) raise(signal);
}

/* An exit code of the FMU's would pass for the verdict of the run. */
static void at_exit(void) {
    if (!current) return;
    tell(current, "called exit");
    _exit(FMU_FAILED);
}

void trackside_watch_crashes(void) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = handle;
    /* A stack that overflowed cannot hold the handler; Rust gives each of its threads another one. */
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    for (int i = 0; i < COUNT; i++) sigaction(SIGNALS[i], &action, &before[i]);
    atexit(at_exit);
}
