/* rights.c - credentials that the kernel vouches for. */
#define _GNU_SOURCE /* struct ucred */
#include "station/rights.h"

#include <grp.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

void rights_init(struct rights *rights, const char *const group[RIGHTS])
{
    rights->own = getuid();
    for (int i = 0; i < RIGHTS; i++) {
        const struct group *found = getgrnam(group[i]);
        rights->group[i] = found != NULL ? found->gr_gid : (gid_t)-1;
    }
}

static void raise_to(struct peer *peer, enum right right)
{
    if (!peer->may || peer->right < right)
        peer->right = right;
    peer->may = true;
}

static void raise_by_group(const struct rights *rights, gid_t gid, struct peer *peer)
{
    for (int i = 0; i < RIGHTS; i++)
        if (rights->group[i] != (gid_t)-1 && rights->group[i] == gid)
            raise_to(peer, (enum right)i);
}

/* The supplementary groups the peer had when it connected. */
static bool raise_by_groups(const struct rights *rights, int fd, struct peer *peer)
{
    gid_t few[64], *gids = few;
    socklen_t size = sizeof few;
    int e = getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, gids, &size);
    if (e != 0 && size > sizeof few) { /* the kernel says how much it wants */
        gids = malloc(size);
        e = gids == NULL ? -1 : getsockopt(fd, SOL_SOCKET, SO_PEERGROUPS, gids, &size);
    }
    for (size_t i = 0; e == 0 && i < size / sizeof *gids; i++)
        raise_by_group(rights, gids[i], peer);
    if (gids != few)
        free(gids);
    return e == 0;
}

bool rights_of_peer(const struct rights *rights, int fd, struct peer *ret)
{
    struct ucred who;
    socklen_t size = sizeof who;
    if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size) != 0)
        return false;
    struct peer peer = { .pid = who.pid, .uid = who.uid };
    if (who.uid == 0 || who.uid == rights->own)
        raise_to(&peer, RIGHT_ADMIN);
    raise_by_group(rights, who.gid, &peer);
    if (!raise_by_groups(rights, fd, &peer))
        return false;
    *ret = peer;
    return true;
}
