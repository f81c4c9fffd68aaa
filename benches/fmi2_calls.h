/* Declares what both programs here that call an FMU of FMI 2.0 need of it. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef void *Component;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;
typedef Component (*Instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int);
typedef int (*Setup)(Component, int, double, double, int, double);
typedef int (*Call)(Component);
typedef int (*GetReal)(Component, const unsigned *, size_t, double *);

static void silent(void *environment, const char *name, int status, const char *category, const char *text, ...) {
    (void)environment, (void)name, (void)status, (void)category, (void)text;
}

static const Callbacks CALLBACKS = {silent, calloc, free, NULL, NULL};

static void *find(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (found) return found;
    fprintf(stderr, "the library has no %s\n", name);
    exit(1);
}

/* Processor time between two readings [ns]. */
static double nanoseconds(struct timespec begin, struct timespec end) {
    return (double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec);
}
