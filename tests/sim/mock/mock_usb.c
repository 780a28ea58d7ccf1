#define _GNU_SOURCE
#include "tests/sim/mock/mock_usb.h"

#include <errno.h>
#include <linux/usbdevice_fs.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <time.h>

#include "tests/sim/mock/usb_descriptor.h"
#include "tests/sim/mock/usb_node.h"

enum { SETUP_BYTES = 8, MOST_TRANSFER = 1 << 20 };

/* A transfer that usbfs has.  `urb` and `buffer` are memory of the program: they may be looked at
 * only in a handler, which is umockdev's thread. */
struct transfer {
    struct transfer *next;
    UMockdevIoctlClient *client; /* only it can have this one back */
    UMockdevIoctlData *urb, *buffer;
    uint8_t endpoint;
    size_t size, n; /* of the data; what has come or gone */
    bool done;
    int status;
    uint8_t *bytes; /* that came */
};

/* An open node. */
struct client {
    struct client *next;
    UMockdevIoctlClient *client; /* not held */
    /* libusb asks for capabilities at once.  One that never asked anything could not open the
     * node, which the preload library notices only after it has connected. */
    bool spoke;
};

struct mock_usb {
    UMockdevTestbed *testbed;
    UMockdevIoctlBase *handler;
    char syspath[128], devname[64];
    const struct sim_kind *kind;
    struct sim *sim;
    struct mock_usb_place place;
    char *serial;

    pthread_t thread;     /* lets time pass */
    pthread_mutex_t lock; /* all below */
    pthread_cond_t changed;
    bool end, plugged, gone;
    struct usb_node node;
    struct transfer *first;
    struct client *clients;
    UMockdevIoctlClient *claimed_by;
    int claim_error;
    bool halted[256]; /* by the endpoint's address */
    struct mock_usb_counts counts;
};

static int64_t now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

/* ---- transfers (locked) -------------------------------------------------------------- */

static void drop(struct transfer **at)
{
    struct transfer *t = *at;
    *at = t->next;
    g_clear_object(&t->buffer);
    g_clear_object(&t->urb);
    g_free(t->bytes);
    g_free(t);
}

static void finish(struct transfer *t, int status)
{
    t->done = true;
    t->status = status;
}

static void pull_out(struct mock_usb *mock)
{
    mock->gone = true;
    for (struct transfer *t = mock->first; t != NULL; t = t->next)
        if (!t->done)
            finish(t, -ESHUTDOWN);
}

static void fail(struct mock_usb *mock, struct transfer *t, int error)
{
    if (error == -EPIPE)
        mock->halted[t->endpoint] = true;
    if (error == -ENODEV)
        pull_out(mock);
    else
        finish(t, error);
}

/* What the instrument has for it by now. */
static void fill(struct mock_usb *mock, struct transfer *t, int64_t *due_us)
{
    size_t packet = usb_descriptor_packet(&mock->place, t->endpoint);
    while (!t->done) {
        int64_t due = INT64_MAX;
        ssize_t more = mock->kind->give(mock->sim, t->endpoint, t->bytes + t->n, t->size - t->n,
                                        now_us(), &due);
        if (more < 0) {
            fail(mock, t, (int)more);
        } else if (more == 0) {
            *due_us = due < *due_us ? due : *due_us;
            return;
        } else {
            t->n += (size_t)more;
            if (t->n == t->size || (size_t)more % packet != 0)
                finish(t, 0);
        }
    }
}

/* Go on with what is under way, at each endpoint the first. */
static void go_on(struct mock_usb *mock, int64_t *due_us)
{
    bool busy[256] = { false };
    for (struct transfer *t = mock->first; t != NULL; t = t->next) {
        if (!t->done && !busy[t->endpoint])
            fill(mock, t, due_us);
        busy[t->endpoint] |= !t->done;
    }
}

static bool any_done(const struct mock_usb *mock)
{
    for (const struct transfer *t = mock->first; t != NULL; t = t->next)
        if (t->done)
            return true;
    return false;
}

static void *let_time_pass(void *arg)
{
    struct mock_usb *mock = arg;
    pthread_mutex_lock(&mock->lock);
    while (!mock->end) {
        int64_t due_us = now_us() + 1000000;
        if (!mock->gone)
            go_on(mock, &due_us);
        usb_node_set_ready(&mock->node, any_done(mock));
        struct timespec due = { .tv_sec = due_us / 1000000, .tv_nsec = due_us % 1000000 * 1000 };
        pthread_cond_timedwait(&mock->changed, &mock->lock, &due);
    }
    pthread_mutex_unlock(&mock->lock);
    return NULL;
}

/* ---- usbfs: each request gives 0 or errno (locked, in umockdev's thread) ------------- */

struct request {
    struct mock_usb *mock;
    UMockdevIoctlClient *client;
    UMockdevIoctlData *arg;  /* the pointer or number itself */
    UMockdevIoctlData *data; /* what it points at; NULL */
};

static int claim(const struct request *r)
{
    struct mock_usb *mock = r->mock;
    mock->counts.claims++;
    if (mock->claim_error != 0)
        return mock->claim_error;
    if (mock->claimed_by != NULL && mock->claimed_by != r->client)
        return EBUSY;
    mock->claimed_by = r->client;
    return 0;
}

static int release(const struct request *r)
{
    r->mock->counts.releases++;
    if (r->mock->claimed_by != r->client)
        return EINVAL;
    r->mock->claimed_by = NULL;
    return 0;
}

static int clear_halt(const struct request *r)
{
    unsigned endpoint;
    memcpy(&endpoint, r->data->data, sizeof endpoint);
    r->mock->counts.halts_cleared++;
    r->mock->halted[endpoint & 0xff] = false;
    return 0;
}

static void control(struct mock_usb *mock, struct transfer *t)
{
    uint8_t *setup = t->buffer->data;
    int n = usb_descriptor_control(mock->kind, &mock->place, setup, t->bytes, t->size);
    t->n = n > 0 ? (size_t)n : 0;
    finish(t, n < 0 ? n : 0);
}

static void send(struct mock_usb *mock, struct transfer *t)
{
    const uint8_t *bytes = t->size > 0 ? t->buffer->data : NULL;
    int error = mock->kind->take(mock->sim, t->endpoint, bytes, t->size, now_us());
    if (error != 0) {
        fail(mock, t, error);
    } else {
        t->n = t->size;
        finish(t, 0);
    }
}

/* May it be submitted? */
static int check(const struct request *r, const struct usbdevfs_urb *urb)
{
    if (urb->buffer_length < 0 || urb->buffer_length > MOST_TRANSFER)
        return EINVAL;
    if (urb->type == USBDEVFS_URB_TYPE_CONTROL)
        return urb->buffer_length < SETUP_BYTES ? EINVAL : 0;
    if (urb->type != USBDEVFS_URB_TYPE_BULK)
        return EINVAL;
    if (usb_descriptor_packet(&r->mock->place, urb->endpoint) == 0)
        return ENOENT;
    return r->mock->claimed_by == r->client ? 0 : EBUSY;
}

static int submit(const struct request *r)
{
    struct mock_usb *mock = r->mock;
    const struct usbdevfs_urb *urb = (const void *)r->data->data;
    int error = check(r, urb);
    if (error != 0)
        return error;
    struct transfer *t = g_new0(struct transfer, 1), **end = &mock->first;
    bool is_control = urb->type == USBDEVFS_URB_TYPE_CONTROL;
    t->client = r->client;
    t->urb = g_object_ref(r->data);
    t->endpoint = urb->endpoint;
    t->size = (size_t)urb->buffer_length - (is_control ? SETUP_BYTES : 0);
    t->bytes = g_malloc0(t->size + 1);
    if (urb->buffer_length > 0)
        t->buffer = umockdev_ioctl_data_resolve(r->data, offsetof(struct usbdevfs_urb, buffer),
                                                (size_t)urb->buffer_length, NULL);
    while (*end != NULL)
        end = &(*end)->next;
    *end = t;
    mock->counts.submitted++;
    if (urb->buffer_length > 0 && t->buffer == NULL)
        finish(t, -EFAULT);
    else if (is_control)
        control(mock, t);
    else if (mock->halted[t->endpoint])
        finish(t, -EPIPE);
    else if ((t->endpoint & 0x80) == 0)
        send(mock, t);
    return 0;
}

static int discard(const struct request *r)
{
    gulong address;
    memcpy(&address, r->arg->data, sizeof address);
    for (struct transfer *t = r->mock->first; t != NULL; t = t->next)
        if (t->client == r->client && t->urb->client_addr == address && !t->done) {
            r->mock->counts.cut++;
            finish(t, -ENOENT);
            return 0;
        }
    return EINVAL;
}

static int reap(const struct request *r)
{
    struct mock_usb *mock = r->mock;
    struct transfer **at = &mock->first;
    while (*at != NULL && ((*at)->client != r->client || !(*at)->done))
        at = &(*at)->next;
    struct transfer *t = *at;
    if (t == NULL) {
        mock->counts.reaps_in_vain++;
        return mock->gone ? ENODEV : EAGAIN;
    }
    struct usbdevfs_urb *urb = (void *)t->urb->data;
    bool is_control = urb->type == USBDEVFS_URB_TYPE_CONTROL;
    bool in = is_control ? (t->buffer->data[0] & 0x80) != 0 : (t->endpoint & 0x80) != 0;
    if (in && t->n > 0)
        memcpy(t->buffer->data + (is_control ? SETUP_BYTES : 0), t->bytes, t->n);
    urb->status = t->status;
    urb->actual_length = (int)t->n;
    umockdev_ioctl_data_set_ptr(r->data, 0, t->urb);
    mock->counts.reaped++;
    drop(at);
    return 0;
}

static int capabilities(const struct request *r)
{
    const unsigned can = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                         USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
    memcpy(r->data->data, &can, sizeof can);
    return 0;
}

static int perform(const struct request *r, gulong what)
{
    bool after_all = what == USBDEVFS_REAPURB || what == USBDEVFS_REAPURBNDELAY ||
                     what == USBDEVFS_DISCARDURB || what == USBDEVFS_RELEASEINTERFACE;
    if (r->mock->gone && !after_all)
        return ENODEV;
    switch (what) {
    case USBDEVFS_GET_CAPABILITIES:
        return capabilities(r);
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
        return claim(r);
    case USBDEVFS_RELEASEINTERFACE:
        return release(r);
    case USBDEVFS_GETDRIVER:
        return ENODATA; /* the kernel has no driver for it */
    case USBDEVFS_CLEAR_HALT:
        return clear_halt(r);
    case USBDEVFS_SETCONFIGURATION:
    case USBDEVFS_SETINTERFACE:
    case USBDEVFS_RESET:
        return 0;
    case USBDEVFS_SUBMITURB:
        return submit(r);
    case USBDEVFS_DISCARDURB:
        return discard(r);
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
        return reap(r);
    default:
        return ENOTTY;
    }
}

static void note_that_it_spoke(struct mock_usb *mock, const UMockdevIoctlClient *client)
{
    for (struct client *c = mock->clients; c != NULL; c = c->next)
        if (c->client == client)
            c->spoke = true;
}

static gboolean on_ioctl(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer user)
{
    struct mock_usb *mock = user;
    (void)handler;
    gulong what = umockdev_ioctl_client_get_request(client);
    size_t size = what >> _IOC_SIZESHIFT & _IOC_SIZEMASK;
    struct request r = { mock, client, umockdev_ioctl_client_get_arg(client), NULL };
    int error = 0;
    if (size > 0) {
        r.data = umockdev_ioctl_data_resolve(r.arg, 0, size, NULL);
        error = r.data == NULL ? EFAULT : 0;
    }
    if (error == 0) {
        pthread_mutex_lock(&mock->lock);
        int64_t due_us = INT64_MAX;
        note_that_it_spoke(mock, client);
        error = perform(&r, what);
        if (!mock->gone)
            go_on(mock, &due_us);
        usb_node_set_ready(&mock->node, any_done(mock));
        pthread_cond_signal(&mock->changed);
        pthread_mutex_unlock(&mock->lock);
    }
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    g_clear_object(&r.data);
    return TRUE;
}

/* ---- who has it open ----------------------------------------------------------------- */

/* umockdev 0.17 announces no close, but lets go of the client. */
static void on_close(gpointer user, GObject *was)
{
    struct mock_usb *mock = user;
    UMockdevIoctlClient *client = (UMockdevIoctlClient *)was;
    pthread_mutex_lock(&mock->lock);
    for (struct client **at = &mock->clients; *at != NULL; at = &(*at)->next)
        if ((*at)->client == client) {
            struct client *closed = *at;
            *at = closed->next;
            g_free(closed);
            break;
        }
    for (struct transfer **at = &mock->first; *at != NULL;)
        if ((*at)->client == client)
            drop(at);
        else
            at = &(*at)->next;
    if (mock->claimed_by == client)
        mock->claimed_by = NULL;
    pthread_mutex_unlock(&mock->lock);
}

static void on_open(UMockdevIoctlBase *handler, UMockdevIoctlClient *client, gpointer user)
{
    struct mock_usb *mock = user;
    struct client *opened = g_new0(struct client, 1);
    (void)handler;
    pthread_mutex_lock(&mock->lock);
    opened->client = client;
    opened->next = mock->clients;
    mock->clients = opened;
    g_object_weak_ref(G_OBJECT(client), on_close, mock);
    pthread_mutex_unlock(&mock->lock);
}

/* ---- plugging ------------------------------------------------------------------------ */

/* The device as umockdev wants it told.  Without its own line for a node: that is ours. */
static char *described(const struct mock_usb *mock)
{
    const struct sim_kind *kind = mock->kind;
    const struct mock_usb_place *place = &mock->place;
    unsigned minor = (place->bus - 1) * 128 + place->device - 1;
    uint8_t descriptors[USB_DESCRIPTOR_MOST];
    size_t n = usb_descriptor_all(kind, place, descriptors);
    GString *text = g_string_new(NULL);
    g_string_append_printf(text, "P: %s\n", mock->syspath + strlen("/sys"));
    g_string_append_printf(text, "E: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DEVNAME=%s\n",
                           mock->devname);
    g_string_append_printf(text, "E: BUSNUM=%03u\nE: DEVNUM=%03u\nE: MAJOR=189\nE: MINOR=%u\n",
                           place->bus, place->device, minor);
    g_string_append_printf(text, "E: PRODUCT=%x/%x/2\nE: ID_VENDOR_ID=%04x\nE: ID_MODEL_ID=%04x\n",
                           kind->vid, kind->pid, kind->vid, kind->pid);
    g_string_append_printf(text, "A: dev=189:%u\\n\nA: busnum=%u\\n\nA: devnum=%u\\n\n", minor,
                           place->bus, place->device);
    g_string_append_printf(text, "A: speed=%s\\n\nA: bConfigurationValue=1\\n\n",
                           place->full_speed ? "12" : "480");
    g_string_append_printf(text, "A: idVendor=%04x\\n\nA: idProduct=%04x\\n\n", kind->vid,
                           kind->pid);
    g_string_append_printf(text, "A: bNumConfigurations=1\\n\nA: product=%s\\n\n", kind->product);
    g_string_append(text, "H: descriptors=");
    for (size_t i = 0; i < n; i++)
        g_string_append_printf(text, "%02X", descriptors[i]);
    g_string_append(text, "\n");
    return g_string_free(text, FALSE);
}

static void make_node(struct mock_usb *mock)
{
    char *root = umockdev_testbed_get_root_dir(mock->testbed);
    char *path = g_strconcat(root, mock->devname, NULL);
    char *folder = g_path_get_dirname(path);
    g_mkdir_with_parents(folder, 0755);
    usb_node_make(&mock->node, path, mock->place.node, mock->place.mode);
    g_free(folder);
    g_free(path);
    g_free(root);
}

/* Whoever may open the node may also reach us. */
static void let_all_connect(struct mock_usb *mock)
{
    char *root = umockdev_testbed_get_root_dir(mock->testbed);
    char *path = g_strconcat(root, "/ioctl", mock->devname, NULL);
    if (chmod(path, 0777) != 0)
        g_error("mock_usb: chmod %s: %s", path, g_strerror(errno));
    g_free(path);
    g_free(root);
}

static void start(struct mock_usb *mock)
{
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&mock->lock, NULL);
    pthread_cond_init(&mock->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&mock->thread, NULL, let_time_pass, mock) != 0)
        g_error("mock_usb: no thread");
}

struct mock_usb *mock_usb_plug(UMockdevTestbed *testbed, const struct sim_kind *kind,
                               struct sim *sim, const struct mock_usb_place *place)
{
    struct mock_usb *mock = g_new0(struct mock_usb, 1);
    GError *error = NULL;
    mock->testbed = testbed;
    mock->kind = kind;
    mock->sim = sim;
    mock->place = *place;
    mock->place.serial = mock->serial = g_strdup(place->serial);
    snprintf(mock->devname, sizeof mock->devname, "/dev/bus/usb/%03u/%03u", place->bus,
             place->device);
    snprintf(mock->syspath, sizeof mock->syspath,
             "/sys/devices/pci0000:00/0000:00:14.0/usb%u/%u-%u", place->bus, place->bus,
             place->device);
    kind->act(sim, "reset", now_us());
    make_node(mock);
    start(mock);
    mock->plugged = true;
    mock->handler = umockdev_ioctl_base_new();
    g_signal_connect(mock->handler, "handle-ioctl", G_CALLBACK(on_ioctl), mock);
    g_signal_connect(mock->handler, "client-connected", G_CALLBACK(on_open), mock);
    /* Before "add" is announced: who hears it opens the node. */
    if (!umockdev_testbed_attach_ioctl(testbed, mock->devname, mock->handler, &error))
        g_error("mock_usb: %s", error->message);
    let_all_connect(mock);
    char *text = described(mock);
    if (!umockdev_testbed_add_from_string(testbed, text, &error))
        g_error("mock_usb: %s", error->message);
    g_free(text);
    return mock;
}

void mock_usb_unplug(struct mock_usb *mock)
{
    pthread_mutex_lock(&mock->lock);
    bool was = mock->plugged;
    mock->plugged = false;
    if (was) {
        pull_out(mock);
        usb_node_set_ready(&mock->node, any_done(mock));
        usb_node_unlink(&mock->node);
        pthread_cond_signal(&mock->changed);
    }
    pthread_mutex_unlock(&mock->lock);
    if (!was)
        return;
    umockdev_testbed_uevent(mock->testbed, mock->syspath, "remove");
    umockdev_testbed_remove_device(mock->testbed, mock->syspath);
    umockdev_testbed_detach_ioctl(mock->testbed, mock->devname, NULL);
}

void mock_usb_free(struct mock_usb *mock)
{
    if (mock == NULL)
        return;
    mock_usb_unplug(mock);
    pthread_mutex_lock(&mock->lock);
    mock->end = true;
    pthread_cond_signal(&mock->changed);
    pthread_mutex_unlock(&mock->lock);
    pthread_join(mock->thread, NULL);

    g_signal_handlers_disconnect_by_data(mock->handler, mock);
    while (mock->clients != NULL) {
        struct client *still = mock->clients;
        mock->clients = still->next;
        g_object_weak_unref(G_OBJECT(still->client), on_close, mock);
        g_free(still);
    }
    while (mock->first != NULL)
        drop(&mock->first);
    g_object_unref(mock->handler);
    usb_node_close(&mock->node);
    pthread_cond_destroy(&mock->changed);
    pthread_mutex_destroy(&mock->lock);
    g_free(mock->serial);
    g_free(mock);
}

/* ---- what fate does, what programs did ----------------------------------------------- */

bool mock_usb_act(struct mock_usb *mock, const char *action)
{
    pthread_mutex_lock(&mock->lock);
    bool known = mock->kind->act(mock->sim, action, now_us());
    pthread_cond_signal(&mock->changed);
    pthread_mutex_unlock(&mock->lock);
    return known;
}

double mock_usb_truth(struct mock_usb *mock, double nm, bool sci)
{
    pthread_mutex_lock(&mock->lock);
    double R = mock->kind->truth(mock->sim, nm, sci);
    pthread_mutex_unlock(&mock->lock);
    return R;
}

bool mock_usb_gone(struct mock_usb *mock)
{
    pthread_mutex_lock(&mock->lock);
    bool gone = mock->gone;
    pthread_mutex_unlock(&mock->lock);
    return gone;
}

void mock_usb_set_claim_error(struct mock_usb *mock, int error)
{
    pthread_mutex_lock(&mock->lock);
    mock->claim_error = error;
    pthread_mutex_unlock(&mock->lock);
}

void mock_usb_set_mode(struct mock_usb *mock, unsigned mode)
{
    usb_node_set_mode(&mock->node, mode);
}

unsigned mock_usb_clients(struct mock_usb *mock)
{
    unsigned n = 0;
    pthread_mutex_lock(&mock->lock);
    for (const struct client *c = mock->clients; c != NULL; c = c->next)
        n += c->spoke;
    pthread_mutex_unlock(&mock->lock);
    return n;
}

struct mock_usb_counts mock_usb_counts(struct mock_usb *mock)
{
    pthread_mutex_lock(&mock->lock);
    struct mock_usb_counts counts = mock->counts;
    pthread_mutex_unlock(&mock->lock);
    return counts;
}
