/* Formats the printf arguments of an FMU's log message and hands the text to Rust. */
#include <stdarg.h>
#include <stdio.h>

/* Longer messages are cut, as by `mailbox.rs`, which says so. */
enum { LONGEST = 4096 };

void trackside_take_log(void *environment, int status, const char *category, const char *text, size_t length);
void trackside_take_log_fmi1(void *component, int status, const char *category, const char *text, size_t length);

/* Takes a message of somebody, an environment or a component. */
typedef void Taker(void *whose, int status, const char *category, const char *text, size_t length);

static void hand_over(Taker *take, void *whose, int status, const char *category, const char *format, va_list arguments) {
    char text[LONGEST + 1];
    int length = format == NULL ? -1 : vsnprintf(text, sizeof text, format, arguments);
    if (length < 0) text[0] = '\0';
    take(whose, status, category, text, length < 0 ? 0 : (size_t)length);
}

void trackside_logger(void *environment, const char *instance, int status, const char *category, const char *format, ...) {
    va_list arguments;
    (void)instance;
    va_start(arguments, format);
    hand_over(trackside_take_log, environment, status, category, format, arguments);
    va_end(arguments);
}

/* The same for FMI 1.0, whose logger gets the component. */
void trackside_logger_fmi1(void *component, const char *instance, int status, const char *category, const char *format, ...) {
    va_list arguments;
    (void)instance;
    va_start(arguments, format);
    hand_over(trackside_take_log_fmi1, component, status, category, format, arguments);
    va_end(arguments);
}
