/* Says which call of whom the process dies in, by a signal or because foreign code calls exit, and sees to its exit code. */
#include <errno.h>
#include <float.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The layout is that of `Note` in binding/activity.rs. */
typedef struct {
    const char *who;
    const char *kind;
    const char *call;
    double time;
} Note;

/* The exit code of a run whose FMU or plugin failed. */
enum { FOREIGN_FAILED = 3 };

static const int SIGNALS[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
enum { COUNT = sizeof SIGNALS / sizeof SIGNALS[0] };
static struct sigaction before[COUNT];

static __thread const Note *current;
/* The call that was entered or returned to last, on any thread: null, or the note of a call that goes on. */
static const Note *volatile latest;

/* The process that was asked for, of which each end but by `trackside_leave` is foreign; 0 when nobody asked. */
static pid_t guarded;
/* The exit code once all results are written, -1 before. */
static volatile sig_atomic_t complete = -1;

/* What another process can read when this one is gone: the time and the name of the call that goes on, and the words of `report`. */
enum { CALL = sizeof(double), WORDS = 64, PAPER = 512 };
static char *paper;
static volatile sig_atomic_t written = WORDS;

void trackside_write_to(char *memory) {
    paper = memory;
}

static void copy_note(const Note *note) {
    if (!note || !note->call) {
        paper[CALL] = '\0';
        return;
    }
    memcpy(paper, &note->time, sizeof note->time);
    for (int i = 0; CALL + i < WORDS - 1 && (paper[CALL + i] = note->call[i]) != '\0'; i++) {}
}

/* Returns the note of the call around this one, if there is one: an FMU may host another. */
const Note *trackside_enter(const Note *note) {
    const Note *outer = current;
    current = note;
    latest = note;
    if (paper) copy_note(note);
    return outer;
}

void trackside_complete(int code) { complete = code; }
int trackside_completed(void) { return complete; }

/* Leaves without destructors: those of foreign libraries may crash, and nothing is left to do for ours. */
void trackside_leave(int code) {
    fflush(stdout);
    fflush(stderr);
    _exit(code);
}

/* A handler may not call printf, nor anything else that allocates or locks. */
static void put(const char *text) {
    for (; paper && *text; text++)
        if (written < PAPER - 1) paper[written++] = *text;
    ssize_t written = write(STDERR_FILENO, text, strlen(text));
    (void)written;
}

/* Writes a number below 1e12 with six digits after the point, without the zeros at its end. */
static void put_number(double number) {
    char digits[32], *at = digits + sizeof digits - 1;
    long long rest = (long long)(number * 1e6 + 0.5);
    int shown = 0;
    *at = '\0';
    for (int digit = 0; digit < 6; digit++, rest /= 10) {
        shown |= rest % 10 != 0;
        if (shown) *--at = (char)('0' + rest % 10);
    }
    if (shown) *--at = '.';
    do *--at = (char)('0' + rest % 10);
    while (rest /= 10);
    put(at);
}

/* Writes a time [s] to the microsecond; from 1e12 s on, where microseconds would overflow, with an exponent. */
static void put_time(double time) {
    int exponent = 0;
    if (time < 0) put("-");
    if (time < 0) time = -time;
    if (time > DBL_MAX) {
        put("inf");
        return;
    }
    if (time >= 1e12)
        for (; time >= 10; time /= 10) exponent++;
    put_number(time);
    if (exponent == 0) return;
    put("e");
    put_number(exponent);
}

static void put_call(const Note *note) {
    /* On paper it stands already. */
    if (paper) return;
    put("\n");
    put(note->who);
    put(": ");
    put(note->call);
    /* Before the experiment is set up there is no time, which is NaN. */
    if (note->time == note->time) {
        put(" at t = ");
        put_time(note->time);
        put(" s");
    }
}

static void put_completeness(void) {
    if (complete >= 0) put("warning: that was after the run: its results are complete, and its verdict stands\n");
}

static void report(const char *what) {
    if (!current) return;
    put_call(current);
    put(paper ? "ended its process: the " : " ended this program: the ");
    put(current->kind);
    put(" ");
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

static int is_handler(const struct sigaction *action) {
    return action->sa_flags & SA_SIGINFO || (action->sa_handler != SIG_DFL && action->sa_handler != SIG_IGN);
}

/* Runs the handler from before ours as the system would. A runtime recovers from faults that are part of its normal
   work: then this returns, or jumps away, and the process goes on. */
static void run_earlier(struct sigaction *earlier, int signal, siginfo_t *info, void *context) {
    sigset_t mask = earlier->sa_mask, saved;
    struct sigaction action = *earlier;
    if (!(action.sa_flags & SA_NODEFER)) sigaddset(&mask, signal);
    if (action.sa_flags & SA_RESETHAND) {
        earlier->sa_flags = 0;
        earlier->sa_handler = SIG_DFL;
    }
    sigprocmask(SIG_BLOCK, &mask, &saved);
    if (action.sa_flags & SA_NODEFER) {
        sigset_t own;
        sigemptyset(&own);
        sigaddset(&own, signal);
        sigprocmask(SIG_UNBLOCK, &own, NULL);
    }
    if (action.sa_flags & SA_SIGINFO)
        action.sa_sigaction(signal, info, context);
    else
        action.sa_handler(signal);
    sigprocmask(SIG_SETMASK, &saved, NULL);
}

/* A handler that gives up leaves the signal to the system: it sets the default and returns. */
static int gave_up(int signal) {
    struct sigaction now;
    return signal == SIGABRT || (sigaction(signal, NULL, &now) == 0 && !is_handler(&now));
}

static void handle(int signal, siginfo_t *info, void *context) {
    int i = 0, error = errno, sent = info->si_code <= 0;
    while (i < COUNT - 1 && SIGNALS[i] != signal) i++;
    struct sigaction *earlier = &before[i];
    if (sent && !is_handler(earlier) && earlier->sa_handler == SIG_IGN) return;
    if (is_handler(earlier)) {
        run_earlier(earlier, signal, info, context);
        errno = error;
        if (!gave_up(signal)) return;
    }
    report(meaning(signal));
    put_completeness();
    if (complete >= 0) _exit(complete);
    /* The signal takes its usual course: a fault comes again, and what was sent is sent again. */
    struct sigaction usual;
    memset(&usual, 0, sizeof usual);
    usual.sa_handler = SIG_DFL;
    sigaction(signal, &usual, NULL);
    if (sent) raise(signal);
}

/* An exit code of foreign code would pass for the verdict of the run. */
static void at_exit(void) {
    const Note *other = latest;
    /* A child that an FMU forks may end as it likes. */
    if (guarded != 0 && getpid() != guarded) return;
    if (!current && guarded == 0) return;
    if (current) {
        report("called exit");
    } else if (other) {
        put_call(other);
        put(" was going on when another thread called exit, which ended this program\n");
    } else {
        put("\nan FMU or a plugin ended this program: it called exit outside of the calls that it gets\n");
    }
    put_completeness();
    _exit(complete >= 0 ? complete : FOREIGN_FAILED);
}

/* Called before the first library is loaded, so that the handlers of an FMU's runtime come before these. */
void trackside_watch_crashes(void) {
    static int watched;
    struct sigaction action;
    if (watched) return;
    watched = 1;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = handle;
    /* A stack that overflowed cannot hold the handler; Rust gives each of its threads another one. */
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    for (int i = 0; i < COUNT; i++) sigaction(SIGNALS[i], &action, &before[i]);
    atexit(at_exit);
#if defined __linux__
    at_quick_exit(at_exit);
#endif
}

/* From here on this process ends by `trackside_leave`: each other exit is taken for foreign code's. */
void trackside_guard_exit(void) {
    trackside_watch_crashes();
    guarded = getpid();
}
