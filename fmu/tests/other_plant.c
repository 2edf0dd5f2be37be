/* A unit of FMI 2.0 by the standard's headers alone, with names and units of its own: a slide that
   a command pushes, between two chambers at rest. It gives neither supply pressure nor velocity. */
#include <stdlib.h>
#include <string.h>

typedef struct {
    double command_mV, place_mm, speed_mm_s, pressure_bar, payload_kg;
} Slide;

void *fmi2Instantiate(const char *name, int kind, const char *token, const char *place,
                      const void *callbacks, int visible, int logging) {
    (void)name, (void)callbacks, (void)visible, (void)logging;
    if (kind != 1 || strcmp(token, "{slide}") || strncmp(place, "file:///", 8)) return NULL;
    Slide *slide = calloc(1, sizeof *slide);
    slide->pressure_bar = 3.0;
    slide->payload_kg = 1.0;
    return slide;
}
void fmi2FreeInstance(void *slide) { free(slide); }
int fmi2SetupExperiment(void *s, int t, double tolerance, double start, int e, double end) {
    (void)s, (void)t, (void)tolerance, (void)e, (void)end;
    return start == 0.0 ? 0 : 3;
}
int fmi2EnterInitializationMode(void *s) { return s ? 0 : 3; }
int fmi2ExitInitializationMode(void *s) { return s ? 0 : 3; }
static double *at(Slide *s, unsigned reference) {
    double *all[] = {&s->command_mV, &s->place_mm, &s->pressure_bar, &s->payload_kg};
    return reference < 4 ? all[reference] : NULL;
}
int fmi2SetReal(void *s, const unsigned *which, size_t count, const double *values) {
    for (size_t i = 0; i < count; i++) {
        if (!at(s, which[i])) return 3;
        *at(s, which[i]) = values[i];
    }
    return 0;
}
int fmi2GetReal(void *s, const unsigned *which, size_t count, double *values) {
    for (size_t i = 0; i < count; i++) {
        if (!at(s, which[i])) return 3;
        values[i] = *at(s, which[i]);
    }
    return 0;
}
int fmi2DoStep(void *s, double now, double step, int no_way_back) {
    (void)no_way_back;
    Slide *slide = s;
    if (now > 0.0495) return 3; /* it ends there */
    slide->place_mm += step * (slide->command_mV - 5000.0) / slide->payload_kg;
    return 0;
}
