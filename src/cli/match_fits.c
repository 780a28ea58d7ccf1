/* match_fits.c - a short list under a lock. */
#include "cli/match_fits.h"

#include <pthread.h>
#include <stdlib.h>

struct fitted_bands {
    double first_nm, step_nm;
    size_t bands;
    struct refiner *refiner;
};

struct match_fits {
    const struct refine_wish *wish;
    const struct table *table;
    pthread_mutex_t lock;
    struct fitted_bands fitted[MATCH_FITS_MAX];
    size_t n;
};

struct match_fits *match_fits_open(const struct refine_wish *wish, const struct table *table)
{
    struct match_fits *fits = calloc(1, sizeof *fits);
    if (fits == NULL)
        return NULL;
    fits->wish = wish;
    fits->table = table;
    pthread_mutex_init(&fits->lock, NULL);
    return fits;
}

void match_fits_close(struct match_fits *fits)
{
    if (fits == NULL)
        return;
    for (size_t i = 0; i < fits->n; i++)
        refiner_close(fits->fitted[i].refiner);
    pthread_mutex_destroy(&fits->lock);
    free(fits);
}

/* With the lock. */
static enum status add(struct match_fits *fits, const struct spectrum *bands, const char **why)
{
    struct fitted_bands *fitted = &fits->fitted[fits->n];
    struct fit fit;
    if (fits->n == MATCH_FITS_MAX) {
        *why = "spectra of more than 16 grids of bands; sort them into files by first_nm, step_nm "
               "and the number of values";
        return STATUS_UNSUPPORTED;
    }
    enum status s = refine_wish_fit(fits->wish, &fits->table->recipe, &fit, why);
    if (s == STATUS_OK)
        s = refiner_open(&fit, bands->first_nm, bands->step_nm, bands->n, &fitted->refiner, why);
    if (s != STATUS_OK)
        return s;
    fitted->first_nm = bands->first_nm;
    fitted->step_nm = bands->step_nm;
    fitted->bands = bands->n;
    fits->n++;
    return STATUS_OK;
}

enum status match_fits_find(struct match_fits *fits, const struct spectrum *bands,
                            const struct refiner **ret, const char **why)
{
    enum status s = STATUS_OK;
    size_t i = 0;
    *why = NULL;
    pthread_mutex_lock(&fits->lock);
    while (i < fits->n &&
           (fits->fitted[i].first_nm != bands->first_nm ||
            fits->fitted[i].step_nm != bands->step_nm || fits->fitted[i].bands != bands->n))
        i++;
    if (i == fits->n)
        s = add(fits, bands, why);
    if (s == STATUS_OK)
        *ret = fits->fitted[i].refiner;
    pthread_mutex_unlock(&fits->lock);
    return s;
}
