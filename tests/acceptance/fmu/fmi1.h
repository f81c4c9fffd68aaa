/* The types of FMI 1.0, with the names of functions of the model MODEL, or plain ones. */
#include <stddef.h>

typedef void *Component;
typedef char Boolean;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } Status;

typedef struct {
    void (*logger)(Component, const char *, Status, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
} ModelCallbacks;

typedef struct {
    void (*logger)(Component, const char *, Status, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(Component, Status);
} SlaveCallbacks;

typedef struct {
    Boolean converged, references_changed, values_changed, terminate, upcoming_time_event;
    double next_time;
} EventInfo;

#define JOIN(a, b) a##b
#define NAME(a, b) JOIN(a, b)
#ifdef PLAIN
#define FMI(name) NAME(fmi, name)
#else
#define FMI(name) NAME(MODEL, NAME(_fmi, name))
#endif
