/* The types of FMI 2.0 that the FMUs of the tests need. */
#pragma once
#include <stddef.h>

typedef void Logger(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    Logger *logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

enum { OK, WARNING, DISCARD, ERROR, FATAL };
