/* What a function of an FMU does wrong, by the environment: FAULT_IN names the function, FAULT what it does there. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static int deep(volatile int *above) {
    volatile int here[4096] = {*above};
    return *above == 0 ? deep(here) + here[1] : 0;
}

/* The status that `function` returns at once, or -1 when it does its work. */
static int fault(const char *function) {
    const char *where = getenv("FAULT_IN"), *what = getenv("FAULT");
    if (!where || !what || strcmp(where, function) != 0) return -1;
    if (strcmp(what, "memory") == 0) *(volatile int *)8 = 1;
    if (strcmp(what, "stack") == 0) {
        volatile int none = 0;
        deep(&none);
    }
    if (strcmp(what, "exit") == 0) exit(0);
    if (strcmp(what, "close") == 0) {
        for (int k = 0; k < 1024; k++) close(k);
        return -1;
    }
    if (strcmp(what, "move") == 0) {
        umask(0777);
        return chdir("/") - 1;
    }
    return atoi(what);
}
