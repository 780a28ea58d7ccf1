/* protocol_schema.h - protocol.schema.json, put into the program when it is built. */
#ifndef SKINSPEC_STATION_PROTOCOL_SCHEMA_H
#define SKINSPEC_STATION_PROTOCOL_SCHEMA_H

/* NUL-terminated. */
extern const char protocol_schema_text[];

#endif
