/* version.h - the one place that says which version this is. */
#ifndef SKINSPEC_BASE_VERSION_H
#define SKINSPEC_BASE_VERSION_H

#define SKINSPEC_VERSION "0.1.0"

#endif
