/* Formats the printf arguments of an FMU's log message and hands the text to Rust. */
#include <stdarg.h>
#include <stdio.h>

/* Longer messages are cut, not lost. */
enum { LONGEST = 4096 };

void trackside_take_log(void *environment, int status, const char *category, const char *text);

void trackside_logger(void *environment, const char *instance, int status, const char *category,
                      const char *format, ...) {
    char text[LONGEST];
    va_list arguments;
    (void)instance;
    va_start(arguments, format);
    if (format == NULL || vsnprintf(text, sizeof text, format, arguments) < 0) text[0] = '\0';
    va_end(arguments);
    trackside_take_log(environment, status, category, text);
}
