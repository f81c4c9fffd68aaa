/* Says which call of whom the process dies in, by a signal or because foreign code calls exit, and sees to its exit code. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <dlfcn.h>
#include <errno.h>
#include <float.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#if defined __linux__
#include <sys/syscall.h>
#include <ucontext.h>
#endif

#include "foreign.h"

/* The exit code of a run whose FMU or plugin failed. */
enum { FOREIGN_FAILED = 3 };

static const int SIGNALS[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
enum { COUNT = sizeof SIGNALS / sizeof SIGNALS[0] };
static struct sigaction before[COUNT];

pid_t trackside_guarded;
/* The process whose crashes are watched: a child that an FMU forks is not it. */
static pid_t home;
/* The exit code once all results are written, -1 before. */
static volatile sig_atomic_t complete = -1;

/* What another process can read when this one is gone: the time and the name of the call that goes on, and the words of `report`. */
enum { CALL = sizeof(double), WORDS = 64, PAPER = 512 };
static char *paper;
static volatile sig_atomic_t words = WORDS;

void trackside_write_to(char *memory) {
    paper = memory;
}

/* Copies the note of the call that goes on there; without one there is none. */
void trackside_copy_note(const Note *note) {
    if (!paper) return;
    if (!note || !note->call) {
        paper[CALL] = '\0';
        return;
    }
    memcpy(paper, &note->time, sizeof note->time);
    for (int i = 0; CALL + i < WORDS - 1 && (paper[CALL + i] = note->call[i]) != '\0'; i++) {}
}

const Note *trackside_current(void) {
    const Note *current = trackside_entered();
    return current ? current : trackside_started();
}

void trackside_complete(int code) { complete = code; }
int trackside_completed(void) { return complete; }

void trackside_end(int code) {
#if defined __linux__
    syscall(SYS_exit_group, code);
    __builtin_unreachable();
#else
    _exit(code);
#endif
}

/* Leaves without destructors: those of foreign libraries may crash, and nothing is left to do for ours. */
void trackside_leave(int code) {
    fflush(stdout);
    fflush(stderr);
    trackside_end(code);
}

/* A handler may not call printf, nor anything else that allocates or locks. */
static void put(const char *text) {
    if (paper) {
        for (; *text && words < PAPER - 1; text++) paper[words++] = *text;
        return;
    }
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

static void report(const Note *note, const char *what) {
    put_call(note);
    put(paper ? "ended its process: the " : " ended this program: the ");
    put(note->kind);
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

/* The instruction that a thread was at, and its stack pointer; null where that is not known. */
static void place(const void *context, const char **instruction, const char **stack) {
    *instruction = *stack = NULL;
#if defined __linux__ && defined __x86_64__
    const greg_t *registers = ((const ucontext_t *)context)->uc_mcontext.gregs;
    *instruction = (const char *)registers[REG_RIP];
    *stack = (const char *)registers[REG_RSP];
#elif defined __linux__ && defined __aarch64__
    *instruction = (const char *)((const ucontext_t *)context)->uc_mcontext.pc;
    *stack = (const char *)((const ucontext_t *)context)->uc_mcontext.sp;
#endif
    (void)context;
}

/* Below the stack pointer there is memory of the same stack, unless that ends here. */
static int overflowed(int signal, const siginfo_t *info, const char *stack) {
    enum { NEAR = 1 << 16 };
    uintptr_t at = (uintptr_t)info->si_addr, top = (uintptr_t)stack;
    return (signal == SIGSEGV || signal == SIGBUS) && stack && at + NEAR > top && at < top + NEAR;
}

/* Lets one thread speak, and only once: another one that dies waits until the process is gone. */
static int may_speak(void) {
    static volatile int spoken;
    static __thread int speaking;
    if (speaking) return 0;
    if (__atomic_exchange_n(&spoken, 1, __ATOMIC_SEQ_CST))
        for (;;) pause();
    return speaking = 1;
}

static void take_usual_course(int signal, int sent) {
    struct sigaction usual;
    memset(&usual, 0, sizeof usual);
    usual.sa_handler = SIG_DFL;
    sigaction(signal, &usual, NULL);
    /* A fault comes again. */
    if (sent) raise(signal);
}

static void handle(int signal, siginfo_t *info, void *context) {
    int i = 0, error = errno, sent = info->si_code <= 0, ours = getpid() == home;
    while (i < COUNT - 1 && SIGNALS[i] != signal) i++;
    struct sigaction *earlier = &before[i];
    const char *instruction, *stack;
    const Note *whose = NULL;
    Note found;
    place(context, &instruction, &stack);
    if (ours && !(sent && info->si_pid != home)) whose = trackside_current();
    if (ours && !sent && !whose && trackside_blame_library(instruction, &found)) whose = &found;
    int overflow = overflowed(signal, info, stack);
    if (sent && !is_handler(earlier) && earlier->sa_handler == SIG_IGN) return;
    /* Rust's own handler would speak of an overflow, too, and abort. */
    if (is_handler(earlier) && !(overflow && whose && trackside_guarded)) {
        run_earlier(earlier, signal, info, context);
        errno = error;
        if (!gave_up(signal)) return;
    }
    if (ours && may_speak()) {
        if (whose) report(whose, overflow ? "overflowed its stack (SIGSEGV)" : meaning(signal));
        put_completeness();
    }
    if (ours && complete >= 0) trackside_end(complete);
    if (whose && trackside_guarded) trackside_end(FOREIGN_FAILED);
    take_usual_course(signal, sent);
}

/* Says who ends the program, which an exit code of foreign code would pass for the verdict of the run. */
static void end_for_foreign_code(const char *what) {
    const Note *mine = trackside_current(), *other = trackside_latest();
    if (mine) {
        report(mine, what);
    } else if (other) {
        put_call(other);
        put(" was going on when another thread ");
        put(what);
        put(", which ended this program\n");
    } else {
        put("\nan FMU or a plugin ended this program: it ");
        put(what);
        put(" outside of the calls that it gets\n");
    }
    put_completeness();
    trackside_end(complete >= 0 ? complete : FOREIGN_FAILED);
}

static void at_exit(void) {
    /* A child that an FMU forks may end as it likes. */
    if (getpid() != home || (!trackside_guarded && !trackside_entered())) return;
    end_for_foreign_code("called exit");
}

/* This program's `_exit` and `_Exit`, which libraries that are loaded later call: orchestrator/build.rs gives it these names. */
__attribute__((noreturn)) void trackside_foreign_exit(int code) {
    if (trackside_guarded && getpid() == trackside_guarded) end_for_foreign_code("called _exit");
    trackside_end(code);
}

/* This program's `pthread_exit`: a thread of foreign code may end so, one that calls it would be missing. */
void trackside_end_thread(void *result) {
    void (*end)(void *) = (void (*)(void *))dlsym(RTLD_NEXT, "pthread_exit");
    if (trackside_entered() && trackside_guarded && getpid() == trackside_guarded)
        end_for_foreign_code("called pthread_exit in a thread that is not its own");
    if (end) end(result);
    trackside_end(FOREIGN_FAILED);
}

static void install(int i, struct sigaction *earlier) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = handle;
    /* A stack that overflowed cannot hold the handler; Rust gives each of its threads another one. */
    action.sa_flags = SA_SIGINFO | SA_ONSTACK;
    sigaction(SIGNALS[i], &action, earlier);
}

/* A handler of an FMU's runtime may stay, since it knows that there was another one: none at all may not. */
int trackside_watch_again(void) {
    int again = 0;
    for (int i = 0; home != 0 && i < COUNT; i++) {
        struct sigaction now;
        if (sigaction(SIGNALS[i], NULL, &now) != 0 || is_handler(&now)) continue;
        install(i, NULL);
        again = 1;
    }
    return again;
}

/* Called before the first library is loaded, so that the handlers of an FMU's runtime come before these. */
void trackside_watch_crashes(void) {
    static int watched;
    if (watched) return;
    watched = 1;
    home = getpid();
    trackside_note_own_libraries();
    for (int i = 0; i < COUNT; i++) install(i, &before[i]);
    atexit(at_exit);
#if defined __linux__
    at_quick_exit(at_exit);
#endif
}

/* A process that goes on in one that it forked is that one from here on. */
void trackside_adopt_process(void) {
    if (home) home = getpid();
    if (trackside_guarded) trackside_guarded = getpid();
}

static void stay(int signal) { (void)signal; }

/* Writing beyond the limit of a file's size is then an error like others. By a handler, which programs that are started from here do
   not inherit. */
static void survive_file_limits(void) {
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = stay;
    action.sa_flags = SA_RESTART;
    sigaction(SIGXFSZ, &action, NULL);
}

/* From here on this process ends by `trackside_leave`: each other exit is taken for foreign code's. */
void trackside_guard_exit(void) {
    survive_file_limits();
    trackside_watch_crashes();
    trackside_note_surroundings();
    trackside_guarded = getpid();
}
