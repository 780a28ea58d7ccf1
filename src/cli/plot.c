/* plot.c - bars in eighths of a line, axes, swatch. */
#include "cli/plot.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { HEIGHT = 8, MAX_COLUMNS = 64 };

/* The program runs in the C locale (numbers), so the character set is read from
 * the environment as the shell has it. */
static bool environment_is_utf8(void)
{
    static const char *const variables[] = { "LC_ALL", "LC_CTYPE", "LANG" };
    for (size_t i = 0; i < sizeof variables / sizeof *variables; i++) {
        const char *value = getenv(variables[i]);
        if (value != NULL && *value != '\0')
            return strstr(value, "UTF-8") != NULL || strstr(value, "utf8") != NULL;
    }
    return false;
}

struct plot_style plot_style_of(FILE *stream)
{
    const char *term = getenv("TERM"), *no_color = getenv("NO_COLOR");
    bool terminal = isatty(fileno(stream)) == 1 && term != NULL && strcmp(term, "dumb") != 0;
    return (struct plot_style){
        .colours = terminal && (no_color == NULL || *no_color == '\0'),
        .blocks = terminal && environment_is_utf8(),
    };
}

/* Bands beyond what fits are thinned evenly. */
static size_t band_of_column(size_t column, size_t columns, size_t n)
{
    return columns > 1 ? column * (n - 1) / (columns - 1) : 0;
}

/* Top of the axis: the next tenth above the highest value. */
static double axis_top(const struct spectrum *s)
{
    double top = 0.1;
    for (size_t i = 0; i < s->n; i++)
        if (s->value[i] > top)
            top = ceil(10.0 * s->value[i]) / 10.0;
    return top;
}

static const char *cell(struct plot_style style, double filled)
{
    static const char *const eighths[] = { " ", "▁", "▂", "▃", "▄", "▅", "▆", "▇", "█" };
    if (!style.blocks)
        return filled >= 0.5 ? "#" : " ";
    int n = (int)lround(8.0 * filled);
    return eighths[n < 0 ? 0 : n > 8 ? 8 : n];
}

static void plot_wavelengths(FILE *stream, const struct spectrum *s, size_t columns, int width)
{
    int at = 0;
    fputs("        ", stream);
    for (size_t c = 0; c < columns; c++) {
        double nm = spectrum_nm(s, band_of_column(c, columns, s->n));
        int place = (int)c * width;
        if (fmod(nm, 50.0) == 0.0 && place >= at)
            at += fprintf(stream, "%*s%.0f ", place - at, "", nm);
    }
    fputs("nm\n", stream);
}

void plot_spectrum(FILE *stream, struct plot_style style, const struct spectrum *s)
{
    size_t columns = s->n < MAX_COLUMNS ? s->n : MAX_COLUMNS;
    int width = columns <= MAX_COLUMNS / 2 ? 2 : 1;
    double top = axis_top(s);
    for (int line = HEIGHT; line > 0; line--) {
        double low = (line - 1) * top / HEIGHT;
        if (line == HEIGHT || line == HEIGHT / 2)
            fprintf(stream, "  %4.2f |", line * top / HEIGHT);
        else
            fputs("       |", stream);
        for (size_t c = 0; c < columns; c++) {
            double R = s->value[band_of_column(c, columns, s->n)];
            for (int i = 0; i < width; i++)
                fputs(cell(style, (R - low) * HEIGHT / top), stream);
        }
        fputc('\n', stream);
    }
    fputs("  0.00 +", stream);
    for (size_t c = 0; c < columns * (size_t)width; c++)
        fputc('-', stream);
    fputc('\n', stream);
    plot_wavelengths(stream, s, columns, width);
}

void plot_swatch(FILE *stream, struct plot_style style, const int sRGB[3])
{
    if (style.colours)
        fprintf(stream, "\033[48;2;%d;%d;%dm        \033[0m", sRGB[0], sRGB[1], sRGB[2]);
}
