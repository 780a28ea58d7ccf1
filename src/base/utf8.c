/* utf8.c - the byte ranges of RFC 3629, section 4. */
#include "base/utf8.h"

#include <stdint.h>
#include <string.h>

/* Bytes that follow a lead byte, and the range of the first of them. */
static int follow(unsigned char lead, unsigned char *low, unsigned char *high)
{
    *low = lead == 0xe0 ? 0xa0 : lead == 0xf0 ? 0x90 : 0x80;
    *high = lead == 0xed ? 0x9f : lead == 0xf4 ? 0x8f : 0xbf;
    if (lead < 0x80)
        return 0;
    if (lead >= 0xc2 && lead <= 0xdf)
        return 1;
    if (lead >= 0xe0 && lead <= 0xef)
        return 2;
    if (lead >= 0xf0 && lead <= 0xf4)
        return 3;
    return -1;
}

static bool is_ascii(const unsigned char eight[8])
{
    uint64_t bits;
    memcpy(&bits, eight, sizeof bits);
    return (bits & UINT64_C(0x8080808080808080)) == 0;
}

bool utf8_is_valid_n(const char *text, size_t n)
{
    const unsigned char *p = (const unsigned char *)text, *end = p + n;
    while (p < end) {
        unsigned char low, high;
        if (end - p >= 8 && is_ascii(p)) { /* nearly all there is */
            p += 8;
            continue;
        }
        int more = follow(*p++, &low, &high);
        if (more < 0 || more > end - p)
            return false;
        for (; more > 0; more--, p++) {
            if (*p < low || *p > high)
                return false;
            low = 0x80;
            high = 0xbf;
        }
    }
    return true;
}

bool utf8_is_valid(const char *text)
{
    return utf8_is_valid_n(text, strlen(text));
}

void utf8_make_plain(char *text)
{
    if (utf8_is_valid(text))
        return;
    for (; *text != '\0'; text++)
        if ((unsigned char)*text >= 0x80)
            *text = '?';
}
