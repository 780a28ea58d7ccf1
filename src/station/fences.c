/* fences.c - asked of the writer before they run out. */
#include "station/fences.h"

#include <stdlib.h>

#include "station/parking.h"
#include "station/station.h"

enum { FENCES_AT_A_TIME = 1 << 20 };

void fences_go_on_above(struct station *station, int64_t fence)
{
    struct fences *fences = &station->fences;
    fences->last = fence > fences->last ? fence : fences->last;
    fences->known = true;
    station_serve_parked(station);
}

static void fences_reserved(struct job *job)
{
    struct write_job *write = (struct write_job *)job;
    struct station *station = write->context;
    station->fences.asked = false;
    fences_go_on_above(station, write->fences.above);
    if (write->status == STATUS_OK) { /* what was left of those before is dropped */
        fences_go_on_above(station, write->fences.first - 1);
        station->fences.reserved = write->fences.first + write->fences.n - 1;
    }
    free(write);
}

void fences_keep(struct station *station)
{
    struct fences *fences = &station->fences;
    bool enough = fences->reserved - fences->last > FENCES_AT_A_TIME / 2;
    struct write_job *write = NULL;
    if (!enough && !fences->asked && station->writer != NULL)
        write = calloc(1, sizeof *write);
    if (write == NULL)
        return; /* without memory: the next lease asks again */
    write->job.done = fences_reserved;
    write->kind = WRITE_FENCES;
    write->fences.n = FENCES_AT_A_TIME;
    write->fences.above = fences->last;
    write->context = station;
    fences->asked = true;
    writer_ask(station->writer, write);
}
