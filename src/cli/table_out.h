/* table_out.h - what a table file holds and how it was made, on standard output. */
#ifndef SKINSPEC_CLI_TABLE_OUT_H
#define SKINSPEC_CLI_TABLE_OUT_H

#include <stdbool.h>

#include "db/table_file.h"

void table_out_info(bool json, const char *path, const struct table_file_info *info);

#endif
