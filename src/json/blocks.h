/* blocks.h - small blocks for cJSON's trees, kept by one thread for its next tree.
 *
 * A tree is many items of 64 bytes, names and short texts.  malloc() keeps seven freed blocks of
 * a size at hand and puts the others through its lists; a request and its answer are a hundred. */
#ifndef SKINSPEC_JSON_BLOCKS_H
#define SKINSPEC_JSON_BLOCKS_H

/* From here on cJSON's blocks of the calling thread are kept, the small ones, up to 64 KiB of
 * them, beside what json_memory_watch() does.  To be called once, after that and before there are
 * other threads; they go on with malloc() and free(), also for trees made here, and the other way
 * round: every block is one of malloc().  Does nothing under AddressSanitizer, which is to see each
 * block freed. */
void json_keep_blocks(void);

/* Frees what is kept, and keeps no more. */
void json_keep_no_blocks(void);

#endif
