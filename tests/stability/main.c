/* main.c - `make stability`: every study, its worst case beside its bar.
 *
 *   stability [ROOM...]          all cases of all rooms, or of those whose names hold ROOM
 *   stability --misses [ROOM...] the same, with every case that misses the bar on stderr
 *   stability --outputs FILE     our outputs over all cases, for --compare
 *   stability --compare A B      two builds' outputs: the largest difference of each study */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/stability/rooms.h"

static void show(const struct study *s, const struct verdict *v)
{
    printf("  %-30s %7zu %10.3g %10.3g %5g  %s\n", s->name, v->cases - v->refused, v->most_ulp,
           v->judged, s->bar, v->met ? "met" : "NOT MET");
    printf("      %s at", s->output[v->output]);
    study_print_case(s, v->x, stdout);
    printf(": %.17g for %.17g, %.3g ulp, condition %.3g\n", v->ours, v->exact, v->ulp,
           v->condition);
    if (v->twin_bits < STUDY_TWIN_BITS)
        printf("      the twin itself holds %.0f bits only\n", v->twin_bits);
    fflush(stdout);
}

static bool wanted(const char *room, int n, char **names)
{
    for (int i = 0; i < n; i++)
        if (strstr(room, names[i]) != NULL)
            return true;
    return n == 0;
}

static int run_all(int n, char **names, FILE *misses)
{
    size_t met = 0, missed = 0;
    printf("  %-30s %7s %10s %10s %5s\n", "", "cases", "worst ulp", "/condition", "bar");
    for (size_t i = 0; i < study_room_count; i++) {
        const struct study_room *room = study_rooms[i];
        if (!wanted(room->name, n, names))
            continue;
        printf("%s\n", room->name);
        for (size_t j = 0; j < room->n; j++) {
            struct verdict v = study_run(&room->studies[j], 1, misses);
            show(&room->studies[j], &v);
            met += v.met ? 1 : 0;
            missed += v.met ? 0 : 1;
        }
    }
    printf("%zu met, %zu not met\n", met, missed);
    wide_done();
    return missed > 0;
}

int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "--misses") == 0)
        return run_all(argc - 2, argv + 2, stderr);
    return run_all(argc - 1, argv + 1, NULL);
}
