/* Notes who starts a thread, for a crash in it, and gives it a stack for the handler: its own may be what overflows. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <dlfcn.h>
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>

#include "foreign.h"

typedef void *(*Begin)(void *);
typedef int (*Create)(pthread_t *, const pthread_attr_t *, Begin, void *);

/* Room for the handler with the widest registers of today, which the system puts there first. */
enum { HANDLER = 1 << 16 };

/* What a thread of foreign code has besides; its instance may be gone before it is. */
typedef struct {
    Begin begin;
    void *argument;
    Note note;
    int is_of_fmu;
    char who[240], call[200];
    char stack[HANDLER];
} Started;

static __thread const Note *started;
static pthread_key_t key;
static pthread_once_t once = PTHREAD_ONCE_INIT;
static int keyed;
static Create create;
static int alive;

const Note *trackside_started(void) { return started; }

int trackside_threads_of_fmus(void) { return __atomic_load_n(&alive, __ATOMIC_ACQUIRE); }

/* At the end of the thread. */
static void forget(void *it) {
    stack_t none;
    memset(&none, 0, sizeof none);
    none.ss_flags = SS_DISABLE;
    started = NULL;
    sigaltstack(&none, NULL);
    int is_of_fmu = ((Started *)it)->is_of_fmu;
    munmap(it, sizeof(Started));
    __atomic_fetch_sub(&alive, is_of_fmu, __ATOMIC_RELEASE);
}

static void prepare(void) {
    keyed = pthread_key_create(&key, forget) == 0;
    create = (Create)dlsym(RTLD_NEXT, "pthread_create");
}

static void *begin(void *it) {
    Started *own = it;
    stack_t handler;
    memset(&handler, 0, sizeof handler);
    handler.ss_sp = own->stack;
    handler.ss_size = sizeof own->stack;
    sigaltstack(&handler, NULL);
    started = &own->note;
    pthread_setspecific(key, own);
    return own->begin(own->argument);
}

/* This program's `pthread_create`, which libraries that are loaded later call: orchestrator/build.rs gives it that name. */
int trackside_start_thread(pthread_t *thread, const pthread_attr_t *attributes, Begin function, void *argument) {
    const Note *note = trackside_current();
    pthread_once(&once, prepare);
    if (!create) return EAGAIN;
    if (!note || !keyed) return create(thread, attributes, function, argument);
    Started *own = mmap(NULL, sizeof *own, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (own == MAP_FAILED) return create(thread, attributes, function, argument);
    own->begin = function;
    own->argument = argument;
    strncpy(own->who, note->who, sizeof own->who - 1);
    if (note == started)
        strncpy(own->call, note->call, sizeof own->call - 1);
    else
        snprintf(own->call, sizeof own->call, "a thread that it started in %s", note->call);
    own->note = (Note){own->who, note->kind, own->call, note->time};
    int is_of_fmu = own->is_of_fmu = strcmp(note->kind, "FMU") == 0;
    __atomic_fetch_add(&alive, is_of_fmu, __ATOMIC_RELEASE);
    int error = create(thread, attributes, begin, own);
    if (error) {
        munmap(own, sizeof *own);
        __atomic_fetch_sub(&alive, is_of_fmu, __ATOMIC_RELEASE);
    }
    return error;
}
