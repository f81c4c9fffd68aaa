/* Remembers which addresses belong to the libraries of foreign code, for crashes outside of the calls that it gets. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "foreign.h"

#if defined __linux__
#include <link.h>

/* The names live in the table: a handler may read them while another thread unloads the library. */
typedef struct {
    uintptr_t begin, end;
    const char *kind;
    char who[240];
} Range;

enum { LIBRARIES = 512 };
static Range ranges[LIBRARIES];
/* What was loaded before any foreign code. */
static uintptr_t own[LIBRARIES];
static int owned;
static pthread_mutex_t changing = PTHREAD_MUTEX_INITIALIZER;

static Range extent(const struct dl_phdr_info *object) {
    Range range = {UINTPTR_MAX, 0, NULL, ""};
    for (int i = 0; i < object->dlpi_phnum; i++) {
        const ElfW(Phdr) *part = &object->dlpi_phdr[i];
        uintptr_t begin = object->dlpi_addr + part->p_vaddr, end = begin + part->p_memsz;
        if (part->p_type != PT_LOAD) continue;
        if (begin < range.begin) range.begin = begin;
        if (end > range.end) range.end = end;
    }
    return range;
}

static int note_own(struct dl_phdr_info *object, size_t size, void *nothing) {
    (void)size, (void)nothing;
    if (owned < LIBRARIES) own[owned++] = extent(object).begin;
    return 0;
}

void trackside_note_own_libraries(void) {
    pthread_mutex_lock(&changing);
    if (owned == 0) dl_iterate_phdr(note_own, NULL);
    pthread_mutex_unlock(&changing);
}

typedef struct {
    const char *who, *kind;
    char seen[LIBRARIES];
} Survey;

static int survey_one(struct dl_phdr_info *object, size_t size, void *context) {
    Survey *survey = context;
    Range found = extent(object);
    int vacant = -1;
    (void)size;
    for (int i = 0; i < owned; i++)
        if (own[i] == found.begin) return 0;
    for (int i = 0; i < LIBRARIES; i++) {
        if (ranges[i].end == found.end && ranges[i].begin == found.begin) {
            survey->seen[i] = 1;
            return 0;
        }
        if (vacant < 0 && ranges[i].end == 0) vacant = i;
    }
    if (vacant < 0 || !survey->who) return 0;
    Range *range = &ranges[vacant];
    range->kind = survey->kind;
    strncpy(range->who, survey->who, sizeof range->who - 1);
    range->begin = found.begin;
    /* The handler looks at the end first: from here on the rest is there. */
    __atomic_store_n(&range->end, found.end, __ATOMIC_RELEASE);
    survey->seen[vacant] = 1;
    return 0;
}

/* Puts down whose all libraries are that came since the last time, and forgets those that are gone. Without a name nobody's are put
   down. */
void trackside_note_libraries(const char *who, const char *kind) {
    Survey survey;
    memset(&survey, 0, sizeof survey);
    survey.who = who;
    survey.kind = kind;
    pthread_mutex_lock(&changing);
    dl_iterate_phdr(survey_one, &survey);
    for (int i = 0; i < LIBRARIES; i++)
        if (ranges[i].end != 0 && !survey.seen[i]) {
            __atomic_store_n(&ranges[i].end, 0, __ATOMIC_RELEASE);
            memset(ranges[i].who, 0, sizeof ranges[i].who);
        }
    pthread_mutex_unlock(&changing);
}

int trackside_blame_library(const void *instruction, Note *note) {
    uintptr_t at = (uintptr_t)instruction;
    for (int i = 0; i < LIBRARIES; i++) {
        uintptr_t end = __atomic_load_n(&ranges[i].end, __ATOMIC_ACQUIRE);
        if (at >= end || at < ranges[i].begin) continue;
        *note = (Note){ranges[i].who, ranges[i].kind, "outside of the calls that it gets", __builtin_nan("")};
        return 1;
    }
    return 0;
}

#else
void trackside_note_own_libraries(void) {}
void trackside_note_libraries(const char *who, const char *kind) { (void)who, (void)kind; }
int trackside_blame_library(const void *instruction, Note *note) {
    (void)instruction, (void)note;
    return 0;
}
#endif
