/* Formats the printf arguments of an FMU's log message and hands the text to Rust. */
#include <stdarg.h>
#include <stdio.h>

/* Longer messages are cut, as by `mailbox.rs`, which says so. */
enum { LONGEST = 4096 };

void trackside_take_log(void *environment, int status, const char *category, const char *text, size_t length);

void trackside_logger(void *environment, const char *instance, int status, const char *category,
                      const char *format, ...) {
    char text[LONGEST + 1];
    int length;
    va_list arguments;
    (void)instance;
    va_start(arguments, format);
    length = format == NULL ? -1 : vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length < 0) {
        length = 0;
        text[0] = '\0';
    }
    trackside_take_log(environment, status, category, text, (size_t)length);
}
