/* main.c - `make stability`: every study, its worst case beside its bar.
 *
 *   stability [ROOM...]          all cases of all rooms, or of those whose names hold ROOM
 *   stability --misses [ROOM...] the same, with every case that misses the bar on stderr
 *   stability --outputs FILE     our outputs over all cases, for --compare
 *   stability --compare A B      two builds' outputs: the largest difference of each study */
#include <stdlib.h>
#include <string.h>

#include "tests/stability/exact_transport.h"
#include "tests/stability/levels.h"
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

/* Counts what is met and what is not. */
struct count {
    size_t met, missed;
};

static void count(struct count *c, bool met)
{
    c->met += met ? 1 : 0;
    c->missed += met ? 0 : 1;
}

static void run_room(const struct study_room *room, FILE *misses, struct count *c)
{
    printf("%s\n", room->name);
    for (size_t j = 0; j < room->n; j++) {
        struct verdict v = study_run(&room->studies[j], 1, misses);
        show(&room->studies[j], &v);
        count(c, v.met);
    }
}

static void show_medium(const char *what, const double x[6])
{
    printf("      %s at sigma_a1 %.17g sigma_s1' %.17g sigma_a2 %.17g sigma_s2' %.17g d %.17g eta "
           "%.17g\n",
           what, x[0], x[1], x[2], x[3], x[4], x[5]);
}

static void run_transport(const char *name, struct count *c)
{
    static const int streams[] = { 4, 8, 16, 32 };
    printf("%s\n  %-30s %7s %10s %10s %5s\n", name, "", "cases", "R, rel.", "slopes", "bar");
    for (size_t i = 0; i < sizeof streams / sizeof *streams; i++) {
        struct exact_transport v;
        bool met = exact_transport(streams[i], &v) && v.R <= EXACT_TRANSPORT_BAR &&
                   v.slopes <= EXACT_TRANSPORT_BAR;
        printf("  transport-%-20d %7zu %10.3g %10.3g %5g  %s\n", streams[i], v.cases, v.R, v.slopes,
               EXACT_TRANSPORT_BAR, met ? "met" : "NOT MET");
        show_medium("R", v.R_at);
        show_medium("slopes", v.slopes_at);
        count(c, met);
    }
}

static int run_all(int n, char **names, FILE *misses)
{
    static const char transport[] = "streams (optics/transport), against their own equations";
    struct count c = { 0 };
    printf("  %-30s %7s %10s %10s %5s\n", "", "cases", "worst ulp", "/condition", "bar");
    for (size_t i = 0; i < study_room_count; i++)
        if (wanted(study_rooms[i]->name, n, names))
            run_room(study_rooms[i], misses, &c);
    if (wanted(transport, n, names))
        run_transport(transport, &c);
    printf("%zu met, %zu not met\n", c.met, c.missed);
    wide_done();
    return c.missed > 0;
}

int main(int argc, char **argv)
{
    if (argc == 3 && strcmp(argv[1], "--outputs") == 0)
        return levels_write(argv[2]);
    if (argc == 4 && strcmp(argv[1], "--compare") == 0)
        return levels_compare(argv[2], argv[3]);
    if (argc > 1 && strcmp(argv[1], "--misses") == 0)
        return run_all(argc - 2, argv + 2, stderr);
    return run_all(argc - 1, argv + 1, NULL);
}
