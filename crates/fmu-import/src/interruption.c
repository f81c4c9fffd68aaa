/* Notes the signals that ask the program to end; a second one ends it at once. */
#include <signal.h>
#include <string.h>
#include <unistd.h>

#include "foreign.h"

static const int REQUESTS[] = {SIGINT, SIGTERM, SIGHUP};
enum { COUNT = sizeof REQUESTS / sizeof REQUESTS[0] };

static volatile sig_atomic_t requested;
static int on_terminal;

int trackside_termination_signal(void) { return requested; }

static void note(int signal) {
    /* When a terminal closes, the system and the shell both send SIGHUP. */
    if (requested == SIGHUP && signal == SIGHUP) return;
    /* What a shell reports of a program that a signal ended. */
    if (requested) trackside_end(128 + signal);
    requested = signal;
    if (signal == SIGINT && on_terminal) {
        static const char text[] = "\nending; Ctrl-C once more ends at once\n";
        ssize_t written = write(STDERR_FILENO, text, sizeof text - 1);
        (void)written;
    }
}

static void ignore(int signal) { (void)signal; }

/* By a handler, which programs that are started from here do not inherit. */
void trackside_ignore_termination_signals(void) {
    for (int i = 0; i < COUNT; i++) {
        struct sigaction action;
        memset(&action, 0, sizeof action);
        action.sa_handler = ignore;
        action.sa_flags = SA_RESTART;
        sigaction(REQUESTS[i], &action, NULL);
    }
}

/* May be called again: the runtime of an FMU may have put a handler of its own there. A signal that is ignored stays so:
   that is how nohup works. */
void trackside_catch_termination_signals(void) {
    on_terminal = isatty(STDERR_FILENO);
    for (int i = 0; i < COUNT; i++) {
        struct sigaction before, action;
        if (sigaction(REQUESTS[i], NULL, &before) == 0 && before.sa_handler == SIG_IGN) continue;
        memset(&action, 0, sizeof action);
        action.sa_handler = note;
        action.sa_flags = SA_RESTART;
        sigaction(REQUESTS[i], &action, NULL);
    }
}
