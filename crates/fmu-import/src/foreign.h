/* Declares what the C files of this crate share: notes of calls, and the end of the process. */
#ifndef TRACKSIDE_FOREIGN_H
#define TRACKSIDE_FOREIGN_H

#include <sys/types.h>

/* The layout is that of `Note` in binding/activity.rs. */
typedef struct {
    const char *who;
    const char *kind;
    const char *call;
    double time;
} Note;

/* binding/activity.rs */
/* The call that this thread is in; null when it is in none. A handler may ask. */
const Note *trackside_entered(void);
/* The call that was entered or returned to last, on any thread: null, or the note of a call that goes on. */
const Note *trackside_latest(void);

/* crash.c */
/* The process that was asked for, of which each end but by `trackside_leave` is foreign; 0 when nobody asked. */
extern pid_t trackside_guarded;
/* What this thread does for foreign code: a call that goes on, or else a thread that such a call started; null for ours. */
const Note *trackside_current(void);
/* Puts the handlers of crashes back where foreign code left none; says whether it did. */
int trackside_watch_again(void);
/* Ends the process at once; unlike `_exit`, which this program gives foreign code as its own. */
__attribute__((noreturn)) void trackside_end(int code);

/* libraries.c */
/* Notes what is loaded so far as this program's own. */
void trackside_note_own_libraries(void);
/* Puts down who the library with this instruction belongs to; 0 when it is none of foreign code. */
int trackside_blame_library(const void *instruction, Note *note);

/* surroundings.c */
/* Notes what the process has before any foreign code, to be put back. */
void trackside_note_surroundings(void);

/* threads.c */
/* The note of a thread that foreign code started; null on all others. */
const Note *trackside_started(void);
/* How many threads there are that FMUs started. */
int trackside_threads_of_fmus(void);

#endif
