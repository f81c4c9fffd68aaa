/* Formats the printf arguments of an FMU's log message and hands the text to Rust. */
#include <stdarg.h>
#include <stdio.h>

/* Longer messages are cut, as by `mailbox.rs`, which says so. */
enum { LONGEST = 4096 };

void trackside_take_log(void *environment, int status, const char *category, const char *text, size_t length);
void trackside_take_log_fmi1(void *component, int status, const char *category, const char *text, size_t length);

/* The text, and its whole length. */
static size_t formatted(char text[LONGEST + 1], const char *format, va_list arguments) {
    int length = format == NULL ? -1 : vsnprintf(text, LONGEST + 1, format, arguments);
    if (length < 0) {
        text[0] = '\0';
        return 0;
    }
    return (size_t)length;
}

void trackside_logger(void *environment, const char *instance, int status, const char *category,
                      const char *format, ...) {
    char text[LONGEST + 1];
    size_t length;
    va_list arguments;
    (void)instance;
    va_start(arguments, format);
    length = formatted(text, format, arguments);
    va_end(arguments);
    trackside_take_log(environment, status, category, text, length);
}

/* The same for FMI 1.0, whose logger gets the component. */
void trackside_logger_fmi1(void *component, const char *instance, int status, const char *category,
                           const char *format, ...) {
    char text[LONGEST + 1];
    size_t length;
    va_list arguments;
    (void)instance;
    va_start(arguments, format);
    length = formatted(text, format, arguments);
    va_end(arguments);
    trackside_take_log_fmi1(component, status, category, text, length);
}
