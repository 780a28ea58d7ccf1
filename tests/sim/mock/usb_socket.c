/* usb_socket.c - the mocks of one simulator, one after the other. */
#include "tests/sim/mock/usb_socket.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/sim/mock/mock_usb.h"

struct usb_socket {
    UMockdevTestbed *bed;
    const struct sim_kind *kind;
    struct sim *sim;
    struct mock_usb *mock; /* plugged in; NULL */
    GSList *pulled;        /* programs may have them open still */
    bool full_speed;
};

struct usb_socket *usb_socket_make(UMockdevTestbed *bed, const struct sim_kind *kind,
                                   const char *options)
{
    struct sim *sim = kind->make(options);
    if (sim == NULL)
        return NULL;
    struct usb_socket *socket = g_new0(struct usb_socket, 1);
    socket->bed = bed;
    socket->kind = kind;
    socket->sim = sim;
    socket->full_speed = strstr(options, "speed=full") != NULL;
    return socket;
}

bool usb_socket_plug(struct usb_socket *socket, const char *place)
{
    struct mock_usb_place at = { .full_speed = socket->full_speed, .mode = 0660 };
    char kind[8] = "";
    if (sscanf(place, "%u/%u/%7s", &at.bus, &at.device, kind) < 2 || at.bus < 1 || at.bus > 127 ||
        at.device < 1 || at.device > 127 || (kind[0] != '\0' && strcmp(kind, "pty") != 0)) {
        fprintf(stderr, "simhost: a USB instrument is plugged in at BUS/DEVICE, 001/005, not %s\n",
                place);
        return false;
    }
    at.node = kind[0] != '\0' ? MOCK_USB_PTY : MOCK_USB_FIFO;
    socket->mock = mock_usb_plug(socket->bed, socket->kind, socket->sim, &at);
    return true;
}

void usb_socket_unplug(struct usb_socket *socket)
{
    mock_usb_unplug(socket->mock);
    socket->pulled = g_slist_prepend(socket->pulled, socket->mock);
    socket->mock = NULL;
}

bool usb_socket_act(struct usb_socket *socket, const char *action)
{
    if (socket->mock != NULL)
        return mock_usb_act(socket->mock, action);
    return socket->kind->act(socket->sim, action, g_get_monotonic_time());
}

void usb_socket_free(struct usb_socket *socket)
{
    mock_usb_free(socket->mock);
    for (GSList *one = socket->pulled; one != NULL; one = one->next)
        mock_usb_free(one->data);
    g_slist_free(socket->pulled);
    socket->kind->free(socket->sim);
    g_free(socket);
}
