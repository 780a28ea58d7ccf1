/* haemoglobin_table.h - molar extinction of haemoglobin, 250..1000 nm by 2. */
#ifndef SKINSPEC_OPTICS_HAEMOGLOBIN_TABLE_H
#define SKINSPEC_OPTICS_HAEMOGLOBIN_TABLE_H

enum { HAEMOGLOBIN_TABLE_FIRST_NM = 250, HAEMOGLOBIN_TABLE_STEP_NM = 2, HAEMOGLOBIN_TABLE_N = 376 };

struct haemoglobin_row {
    double oxy, deoxy; /* cm^-1/M */
};

extern const struct haemoglobin_row haemoglobin_table[HAEMOGLOBIN_TABLE_N];

#endif
