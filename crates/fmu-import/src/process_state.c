/* Puts back what a call of foreign code changed around itself: how the processor rounds, the locale, folder, masks. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <fcntl.h>
#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#if defined __APPLE__
#include <xlocale.h>
#endif

#include "foreign.h"

/* The bits are those of `Changes` in binding/process_state.rs. */
enum { ROUNDING = 1, TINY = 2, TRAPS = 4, LOCALE = 8, FOLDER = 16, UMASK = 32, SIGNALS = 64, HANDLERS = 128 };

/* The layout is that of `Before` in binding/process_state.rs. */
typedef struct {
    uint64_t control;
    void *locale;
    uint32_t x87;
} Before;

#if defined __x86_64__
/* Flags of what happened in calculations are none of what rules them. */
enum { FLAGS = 0x3f, NO_TRAPS = 0x1f80, ROUNDED = 0x6000, FLUSHED = 0x8040 };
static inline uint64_t control(void) {
    uint32_t now;
    __asm__ volatile("stmxcsr %0" : "=m"(now));
    return now & ~(uint32_t)FLAGS;
}
static inline void set_control(uint64_t wanted) {
    uint32_t now = (uint32_t)wanted;
    __asm__ volatile("ldmxcsr %0" : : "m"(now));
}
static inline uint32_t x87(void) {
    uint16_t now;
    __asm__ volatile("fnstcw %0" : "=m"(now));
    return now;
}
static inline void set_x87(uint32_t wanted) {
    uint16_t now = (uint16_t)wanted;
    __asm__ volatile("fldcw %0" : : "m"(now));
}
#elif defined __aarch64__
enum { NO_TRAPS = 0x9f00, ROUNDED = 0xc00000, FLUSHED = 0x1000000 };
static inline uint64_t control(void) {
    uint64_t now;
    __asm__ volatile("mrs %0, fpcr" : "=r"(now));
    return now;
}
static inline void set_control(uint64_t wanted) { __asm__ volatile("msr fpcr, %0" : : "r"(wanted)); }
static inline uint32_t x87(void) { return 0; }
static inline void set_x87(uint32_t wanted) { (void)wanted; }
#else
enum { NO_TRAPS = 0, ROUNDED = -1, FLUSHED = 0 };
static inline uint64_t control(void) { return (uint64_t)fegetround(); }
static inline void set_control(uint64_t wanted) { fesetround((int)wanted); }
static inline uint32_t x87(void) { return 0; }
static inline void set_x87(uint32_t wanted) { (void)wanted; }
#endif

/* What the process had when it was guarded, before any foreign code. */
static Before home;
static const char *home_locale;
static struct stat home_folder;
static int home_descriptor = -1;
static mode_t home_umask;

static void look(Before *before) {
    before->control = control();
    before->x87 = x87();
    before->locale = uselocale((locale_t)0);
}

void trackside_note_surroundings(void) {
    look(&home);
    const char *now = setlocale(LC_ALL, NULL);
    /* Where something else was loaded before this program, its locale is left alone. */
    if (now && strcmp(now, "C") == 0) home_locale = now;
    home_descriptor = open(".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (home_descriptor >= 0 && fstat(home_descriptor, &home_folder) != 0) home_descriptor = -1;
    home_umask = umask(0);
    umask(home_umask);
}

void trackside_before(Before *before) { look(before); }

static int put_numbers_back(const Before *before) {
    int changes = 0;
    uint64_t now = control();
    uint32_t legacy = x87();
    if (__builtin_expect(now != before->control || legacy != before->x87, 0)) {
        uint64_t different = now ^ before->control;
        uint32_t masks = 0x3f, precision = 0xf00;
        if (different & (uint64_t)ROUNDED || (legacy ^ before->x87) & (precision | 0xc00)) changes |= ROUNDING;
        if (different & (uint64_t)FLUSHED) changes |= TINY;
        if (different & (uint64_t)NO_TRAPS || (legacy ^ before->x87) & masks) changes |= TRAPS;
        set_control(before->control);
        set_x87(before->x87);
    }
    return changes;
}

static inline int put_locale_back(const Before *before) {
    int changes = 0;
    if (__builtin_expect(uselocale((locale_t)0) != (locale_t)before->locale, 0)) {
        uselocale((locale_t)before->locale);
        changes |= LOCALE;
    }
    /* The name stays at its address as long as the locale is the same. */
    if (__builtin_expect(home_locale && setlocale(LC_ALL, NULL) != home_locale, 0)) {
        setlocale(LC_ALL, "C");
        changes |= LOCALE;
    }
    return changes;
}

/* Puts back what each call may change; says what that was. In a guarded program there is nothing from before. */
int trackside_after(const Before *before) {
    if (!before) before = &home;
    return put_numbers_back(before) | put_locale_back(before);
}

/* The signals that this thread holds back; the layout is that of `Mask` in binding/process_state.rs. */
void trackside_signals(sigset_t *mask) { pthread_sigmask(SIG_SETMASK, NULL, mask); }

/* The same for what only a call that is rare, such as that which makes an instance, is looked at for. */
int trackside_after_rare(const sigset_t *mask) {
    int changes = 0;
    sigset_t now;
    struct stat folder;
    pthread_sigmask(SIG_SETMASK, mask, &now);
    for (int signal = 1; signal < NSIG; signal++)
        if (sigismember(&now, signal) != sigismember(mask, signal)) changes |= SIGNALS;
    if (trackside_watch_again()) changes |= HANDLERS;
    if (home_descriptor < 0) return changes;
    if (stat(".", &folder) != 0 || folder.st_dev != home_folder.st_dev || folder.st_ino != home_folder.st_ino)
        if (fchdir(home_descriptor) == 0) changes |= FOLDER;
    if (umask(home_umask) != home_umask) changes |= UMASK;
    return changes;
}
