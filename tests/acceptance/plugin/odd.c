// A plugin that does what its configuration says, most of it wrong. VERSION is the interface's that it claims.
#include <fenv.h>
#include <stdbool.h>
#include <stdint.h>
#include <stddef.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct { const char *data; size_t len; } Text;
typedef struct { Text name, unit; const double *time, *values; size_t len; } Column;
typedef struct { Text name, unit, description; uint8_t required; } Need;
typedef struct { Text name; uint32_t shape, role; const double *x, *y, *upper; size_t len; } Layer;
typedef struct { Text title, axes[2]; double ranges[2][2]; const Layer *layers; size_t count; } Diagram;
typedef struct { uint32_t status; const Text *path; size_t depth; Text text; } Outcome;
enum { DONE, BAD_CONFIG, FAILED };
typedef struct {
    void *context;
    uint8_t (*progress)(void *, double, Text);
    void (*record)(void *, Text, const Column *, size_t);
    void (*diagram)(void *, Text, const Diagram *);
    void (*file)(void *, Text, Text);
    void (*done)(void *, const Outcome *);
} Callbacks;
typedef void (*Call)(Text, const Column *, size_t, const Callbacks *);
typedef struct {
    uint32_t version;
    Call check, run;
    void (*needs)(void *, void (*)(void *, const Need *, size_t));
    void (*schema)(void *, void (*)(void *, Text));
} Vtable;

static Text text(const char *words) { return (Text){words, strlen(words)}; }
static bool says(Text config, const char *word) { return memmem(config.data, config.len, word, strlen(word)) != NULL; }

static void check(Text config, const Column *columns, size_t count, const Callbacks *host) {
    Text path[] = {text("mode")};
    Outcome good = {DONE}, bad = {BAD_CONFIG, path, 1, text("expected anything else, found \"wrong\"")};
    host->done(host->context, says(config, "wrong") ? &bad : &good);
}

static void *leave(void *nothing) {
    exit(0);
    return nothing;
}
static void *crash(void *nothing) {
    volatile int *nowhere = NULL;
    *nowhere = 0;
    return nothing;
}
static int overflow(volatile int depth) {
    volatile char frame[4096];
    frame[0] = (char)depth;
    return depth < 0 ? 0 : overflow(depth + 1) + frame[0];
}
static void on_a_thread(void *(*what)(void *)) {
    pthread_t thread;
    pthread_create(&thread, NULL, what, NULL);
    pthread_join(thread, NULL);
}

static void run(Text config, const Column *columns, size_t count, const Callbacks *host) {
    double time[] = {0.0, -1.0}, values[] = {1.0, 2.0};
    Column column = {text("x"), text("m"), time, values, 2};
    host->progress(host->context, 0.5, text("half"));
    if (says(config, "goes on")) {
        fclose(fopen("analysis.begun", "w"));
        while (host->progress(host->context, 0.5, text("more"))) usleep(1000);
    }
    if (says(config, "\"exits")) exit(0);
    if (says(config, "_exits")) _exit(0);
    if (says(config, "overflows")) overflow(0);
    if (says(config, "crashes")) on_a_thread(crash);
    if (says(config, "rounds")) fesetround(FE_UPWARD);
    if (says(config, "aborts")) abort();
    if (says(config, "leaves")) on_a_thread(leave);
    if (says(config, "silent")) return;
    if (says(config, "fails")) { host->done(host->context, &(Outcome){FAILED, NULL, 0, text("no tire in sight")}); return; }
    if (says(config, "escapes")) host->file(host->context, text("../escaped.txt"), text("out"));
    if (says(config, "overwrites")) host->file(host->context, text("report.json"), text("{}"));
    if (says(config, "backwards")) host->record(host->context, text("group"), &column, 1);
    if (says(config, "draws")) {
        Layer layer = {text("curve"), 7, 9, time, says(config, "half") ? NULL : values, NULL, 2};
        double from = says(config, "flat") ? 1.0 : 0.0, open = says(config, "open") ? 0.0 / 0.0 : 1.0;
        Diagram diagram = {text("x over y"), {text("x"), text("y")}, {{0.0, open}, {from, 1.0}}, &layer, 1};
        host->diagram(host->context, text("group"), &diagram);
    }
    if (says(config, "writes")) host->file(host->context, text("note.txt"), text("a note"));
    if (says(config, "finds")) host->file(host->context, text("found.toml"), text("\"twin.body.m\" = 900.0"));
    if (says(config, "errs")) host->file(host->context, text("found.toml"), text("[twin]\nbody.mm = 900.0"));
    Text result = text(says(config, "babbles") ? "not JSON" : "{\"list\": [1, 2.5], \"fine\": true}");
    host->done(host->context, &(Outcome){DONE, NULL, 0, result});
}

static void needs(void *context, void (*take)(void *, const Need *, size_t)) {
    Need all[] = {{{"speed", 5}, {"m/s", 3}, {"how fast", 8}, true}, {{"any", 3}, {"", 0}, {"anything", 8}, false}};
    take(context, all, 2);
}

static const Vtable TABLE = {VERSION, check, run, needs, NULL};
const Vtable *trackside_plugin(void) { return &TABLE; }
