/* doctor_device.c - /sys/class/tty, /sys/bus/usb/devices, and who may and does use a node. */
#define _DEFAULT_SOURCE /* major() */
#include "cli/doctor_device.h"

#include <ctype.h>
#include <dirent.h>
#include <grp.h>
#include <pwd.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "cli/member.h"
#include "json/give.h"

enum { PATH_SIZE = 512, TEXT_SIZE = 128, NUMBER_SIZE = 2 * TEXT_SIZE, LEVELS = 7 };

/* ---- what a driver takes ------------------------------------------------------------ */

size_t doctor_read_matches(const char *drivers, struct doctor_match matches[DOCTOR_MATCHES])
{
    size_t n = 0;
    char *text = strdup(drivers), *lines = NULL, *words;
    for (char *line = text != NULL ? strtok_r(text, "\n", &lines) : NULL; line != NULL;
         line = strtok_r(NULL, "\n", &lines)) {
        const char *driver = strtok_r(line, " ", &words), *number;
        while (driver != NULL && n < DOCTOR_MATCHES &&
               (number = strtok_r(NULL, " ", &words)) != NULL) {
            const char *kind = strtok_r(NULL, " ", &words);
            snprintf(matches[n].driver, sizeof matches[n].driver, "%s", driver);
            snprintf(matches[n].number, sizeof matches[n].number, "%s", number);
            matches[n++].usb = kind != NULL && strcmp(kind, "usb") == 0;
        }
    }
    free(text);
    return n;
}

static const char *driver_of(const struct doctor_match *matches, size_t n, const char *number,
                             bool usb)
{
    for (size_t i = 0; i < n; i++) {
        const char *any = strchr(matches[i].number, '*');
        size_t same = any != NULL ? (size_t)(any - matches[i].number) : strlen(number);
        if (matches[i].usb == usb && strncmp(matches[i].number, number, same) == 0)
            return matches[i].driver;
    }
    return NULL;
}

/* ---- files -------------------------------------------------------------------------- */

/* FOLDER/NAME's first line, printable; "" where there is none. */
static const char *read_line(const char *folder, const char *name, char text[TEXT_SIZE])
{
    char path[PATH_SIZE];
    size_t n = 0;
    int c;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "re");
    text[0] = '\0';
    if (file == NULL)
        return text;
    while (n + 1 < TEXT_SIZE && (c = getc(file)) != EOF && c != '\n')
        text[n++] = (char)(c >= ' ' && c <= '~' ? c : '?');
    text[n] = '\0';
    fclose(file);
    return text;
}

static void add_known(cJSON *object, const char *name, const char *text)
{
    if (text != NULL && *text != '\0')
        cJSON_AddStringToObject(object, name, text);
}

static void add_line(cJSON *object, const char *name, const char *folder, const char *file)
{
    char text[TEXT_SIZE];
    add_known(object, name, read_line(folder, file, text));
}

static void add_problem(cJSON *problems, const char *what, const char *todo)
{
    cJSON *one = cJSON_CreateObject();
    cJSON_AddStringToObject(one, "what", what);
    cJSON_AddStringToObject(one, "do", todo);
    json_give_item(problems, one);
}

/* Names in a folder, in order.  Not by scandir(): what is mocked for tests it does not see. */
struct names {
    char name[256][64];
    size_t n;
};

static int compare_names(const void *left, const void *right)
{
    return strcmp(left, right);
}

static void read_names(const char *folder, struct names *ret)
{
    DIR *all = opendir(folder);
    const struct dirent *one;
    ret->n = 0;
    while (all != NULL && ret->n < sizeof ret->name / sizeof *ret->name &&
           (one = readdir(all)) != NULL)
        if (one->d_name[0] != '.' && strlen(one->d_name) < sizeof *ret->name)
            strcpy(ret->name[ret->n++], one->d_name);
    if (all != NULL)
        closedir(all);
    qsort(ret->name, ret->n, sizeof *ret->name, compare_names);
}

/* ---- processes ---------------------------------------------------------------------- */

static bool is_number(const char *text)
{
    return isdigit((unsigned char)*text) && text[strspn(text, "0123456789")] == '\0';
}

/* The id of a process of that name; 0. */
static long process_named(const char *name)
{
    char folder[PATH_SIZE], text[TEXT_SIZE];
    DIR *all = opendir("/proc");
    const struct dirent *one;
    long found = 0;
    while (all != NULL && found == 0 && (one = readdir(all)) != NULL) {
        snprintf(folder, sizeof folder, "/proc/%.40s", one->d_name);
        if (is_number(one->d_name) && strcmp(read_line(folder, "comm", text), name) == 0)
            found = strtol(one->d_name, NULL, 10);
    }
    if (all != NULL)
        closedir(all);
    return found;
}

static bool has_open(const char *process, const char *node)
{
    char folder[PATH_SIZE], link[PATH_SIZE], target[PATH_SIZE];
    snprintf(folder, sizeof folder, "/proc/%.40s/fd", process);
    DIR *all = opendir(folder); /* of others: root's alone */
    const struct dirent *one;
    bool found = false;
    while (all != NULL && !found && (one = readdir(all)) != NULL) {
        snprintf(link, sizeof link, "%.100s/%.40s", folder, one->d_name);
        ssize_t n = readlink(link, target, sizeof target - 1);
        if (n > 0) {
            target[n] = '\0';
            found = strcmp(target, node) == 0;
        }
    }
    if (all != NULL)
        closedir(all);
    return found;
}

static long holder_by_lock_file(const char *node)
{
    char name[PATH_SIZE], text[TEXT_SIZE];
    const char *end = strrchr(node, '/');
    snprintf(name, sizeof name, "LCK..%.60s", end != NULL ? end + 1 : node);
    long pid = strtol(read_line("/run/lock", name, text), NULL, 10);
    snprintf(name, sizeof name, "/proc/%ld", pid);
    return pid > 0 && access(name, F_OK) == 0 ? pid : 0;
}

/* Who has it open; 0: nobody that may be seen. */
static long holder_of(const char *node)
{
    DIR *all = opendir("/proc");
    const struct dirent *one;
    long found = holder_by_lock_file(node);
    while (all != NULL && found == 0 && (one = readdir(all)) != NULL)
        if (is_number(one->d_name) && has_open(one->d_name, node))
            found = strtol(one->d_name, NULL, 10);
    if (all != NULL)
        closedir(all);
    return found;
}

/* ---- a node ------------------------------------------------------------------------- */

/* What udev's rules have set for it: "E:NAME=..." in its database. */
static bool has_property(const struct stat *st, const char *name)
{
    char path[PATH_SIZE], line[PATH_SIZE];
    size_t n = strlen(name);
    bool found = false;
    snprintf(path, sizeof path, "/run/udev/data/c%u:%u", major(st->st_rdev), minor(st->st_rdev));
    FILE *file = fopen(path, "re");
    while (file != NULL && !found && fgets(line, sizeof line, file) != NULL)
        found =
            strncmp(line, "E:", 2) == 0 && strncmp(line + 2, name, n) == 0 && line[2 + n] == '=';
    if (file != NULL)
        fclose(file);
    return found;
}

static void add_permission(cJSON *device, const struct stat *st)
{
    char mode[8];
    const struct passwd *owner = getpwuid(st->st_uid);
    const struct group *group = getgrgid(st->st_gid);
    snprintf(mode, sizeof mode, "%04o", (unsigned)(st->st_mode & 07777));
    add_known(device, "owner", owner != NULL ? owner->pw_name : NULL);
    add_known(device, "group", group != NULL ? group->gr_name : NULL);
    cJSON_AddStringToObject(device, "mode", mode);
}

static void find_permission_problems(cJSON *device, const char *node, const struct stat *st,
                                     cJSON *problems)
{
    char todo[3 * TEXT_SIZE];
    const char *group = member_text(device, "group");
    if (access(node, R_OK | W_OK) == 0)
        return;
    if ((st->st_mode & 0060) == 0060 && *group != '\0')
        snprintf(todo, sizeof todo,
                 "become a member of its group: sudo adduser $USER %s, then log in again", group);
    else
        snprintf(todo, sizeof todo,
                 "install systemd/60-skinspec.rules into /etc/udev/rules.d, then: sudo udevadm "
                 "control --reload && sudo udevadm trigger");
    add_problem(problems, "you may not open it", todo);
}

static void find_holder(const char *node, cJSON *problems)
{
    char folder[TEXT_SIZE], name[TEXT_SIZE], what[3 * TEXT_SIZE], todo[3 * TEXT_SIZE];
    long pid = holder_of(node);
    if (pid == 0)
        return;
    snprintf(folder, sizeof folder, "/proc/%ld", pid);
    (void)read_line(folder, "comm", name);
    snprintf(what, sizeof what, "it is held by %s, process %ld", name, pid);
    if (strcmp(name, "skinspecd") == 0)
        snprintf(todo, sizeof todo,
                 "nothing, if that is your station; to examine it here end the station first: "
                 "sudo systemctl stop skinspecd.socket skinspecd");
    else
        snprintf(todo, sizeof todo, "end it: it and the station would take each other's bytes");
    add_problem(problems, what, todo);
}

static void find_rule_problems(const cJSON *device, const struct stat *st, cJSON *problems)
{
    if (access("/run/udev/data", F_OK) != 0 || member(device, "driver") == NULL)
        return; /* no udev here, or nothing that its rules are about */
    if (!has_property(st, "SKINSPEC_INSTRUMENT"))
        add_problem(problems,
                    "udev does not know it for an instrument: ModemManager may write to it and the "
                    "station may not open it",
                    "install systemd/60-skinspec.rules and 91-skinspec-alone.rules into "
                    "/etc/udev/rules.d, then: sudo udevadm control --reload && sudo udevadm "
                    "trigger");
}

static void look_at_node(cJSON *device, const char *node)
{
    struct stat st;
    cJSON *problems = cJSON_CreateArray();
    if (stat(node, &st) != 0) {
        add_problem(problems, "there is no such node",
                    "in a container, pass the device into it; else see 'dmesg' for why");
    } else {
        add_permission(device, &st);
        find_permission_problems(device, node, &st, problems);
        find_rule_problems(device, &st, problems);
        find_holder(node, problems);
    }
    json_give_member(device, "problems", problems);
}

/* ---- ttys --------------------------------------------------------------------------- */

/* The folder of the USB device above; false: there is none. */
static bool usb_parent(const char *tty, char folder[PATH_SIZE])
{
    char file[PATH_SIZE];
    size_t n = (size_t)snprintf(folder, PATH_SIZE, "/sys/class/tty/%.60s", tty);
    for (int i = 0; i < LEVELS; i++) {
        snprintf(file, sizeof file, "%.400s/idVendor", folder);
        if (access(file, F_OK) == 0)
            return true;
        n += (size_t)snprintf(folder + n, PATH_SIZE - n, "/..");
    }
    return false;
}

/* The name in /dev/serial/by-id that stays the same. */
static void add_by_id(cJSON *device, const char *tty)
{
    char path[PATH_SIZE], target[PATH_SIZE];
    DIR *all = opendir("/dev/serial/by-id");
    const struct dirent *one;
    while (all != NULL && (one = readdir(all)) != NULL) {
        snprintf(path, sizeof path, "/dev/serial/by-id/%.255s", one->d_name);
        ssize_t n = readlink(path, target, sizeof target - 1);
        if (n <= 0)
            continue;
        target[n] = '\0';
        const char *end = strrchr(target, '/');
        if (strcmp(end != NULL ? end + 1 : target, tty) == 0) {
            cJSON_AddStringToObject(device, "by_id", path);
            break;
        }
    }
    if (all != NULL)
        closedir(all);
}

/* With the members of its USB side; the number in number. */
static cJSON *device_of(const char *folder, const char *kind, const char *node,
                        char number[NUMBER_SIZE])
{
    char vid[TEXT_SIZE], pid[TEXT_SIZE];
    cJSON *device = cJSON_CreateObject();
    snprintf(number, NUMBER_SIZE, "%s:%s", read_line(folder, "idVendor", vid),
             read_line(folder, "idProduct", pid));
    cJSON_AddStringToObject(device, "node", node);
    cJSON_AddStringToObject(device, "kind", kind);
    cJSON_AddStringToObject(device, "usb", number);
    add_line(device, "maker", folder, "manufacturer");
    add_line(device, "product", folder, "product");
    add_line(device, "serial", folder, "serial");
    return device;
}

static void look_at_ttys(const struct doctor_match *matches, size_t n, cJSON *devices)
{
    char folder[PATH_SIZE], node[PATH_SIZE], number[NUMBER_SIZE];
    struct names ttys;
    read_names("/sys/class/tty", &ttys);
    for (size_t i = 0; i < ttys.n; i++) {
        const char *tty = ttys.name[i];
        if (usb_parent(tty, folder)) {
            snprintf(node, sizeof node, "/dev/%.60s", tty);
            cJSON *device = device_of(folder, "tty", node, number);
            add_known(device, "driver", driver_of(matches, n, number, false));
            add_by_id(device, tty);
            look_at_node(device, node);
            json_give_item(devices, device);
        }
    }
}

/* ---- USB devices -------------------------------------------------------------------- */

static void look_at_usb(const struct doctor_match *matches, size_t n, cJSON *devices)
{
    char folder[PATH_SIZE], node[PATH_SIZE], number[NUMBER_SIZE], bus[TEXT_SIZE], dev[TEXT_SIZE];
    struct names found;
    read_names("/sys/bus/usb/devices", &found);
    for (size_t i = 0; i < found.n; i++) {
        snprintf(folder, sizeof folder, "/sys/bus/usb/devices/%s", found.name[i]);
        long b = strtol(read_line(folder, "busnum", bus), NULL, 10);
        long d = strtol(read_line(folder, "devnum", dev), NULL, 10);
        snprintf(node, sizeof node, "/dev/bus/usb/%03ld/%03ld", b, d);
        cJSON *device = device_of(folder, "usb", node, number);
        const char *driver = driver_of(matches, n, number, true);
        if (driver == NULL) {
            cJSON_Delete(device);
            continue;
        }
        cJSON_AddStringToObject(device, "driver", driver);
        look_at_node(device, node);
        json_give_item(devices, device);
    }
}

cJSON *doctor_devices(const struct doctor_match *matches, size_t n)
{
    cJSON *devices = cJSON_CreateArray();
    look_at_ttys(matches, n, devices);
    look_at_usb(matches, n, devices);
    return devices;
}

/* ---- what disturbs ------------------------------------------------------------------ */

static bool has_rule(const char *name)
{
    static const char *const folders[] = { "/etc/udev/rules.d", "/run/udev/rules.d",
                                           "/usr/local/lib/udev/rules.d", "/usr/lib/udev/rules.d",
                                           "/lib/udev/rules.d" };
    char path[PATH_SIZE];
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        snprintf(path, sizeof path, "%s/%s", folders[i], name);
        if (access(path, R_OK) == 0)
            return true;
    }
    return false;
}

cJSON *doctor_disturbers(void)
{
    static const struct {
        const char *process, *rule, *does;
    } known[] = {
        { "ModemManager", "60-skinspec.rules", "sends modem commands to every new tty" },
        { "brltty", "91-skinspec-alone.rules", "takes ports of adaptors for braille displays" },
    };
    cJSON *found = cJSON_CreateArray();
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        char what[2 * TEXT_SIZE], todo[2 * TEXT_SIZE];
        long pid = process_named(known[i].process);
        if (pid == 0 || has_rule(known[i].rule))
            continue;
        snprintf(what, sizeof what, "%s runs (process %ld): it %s", known[i].process, pid,
                 known[i].does);
        snprintf(todo, sizeof todo,
                 "install systemd/%s into /etc/udev/rules.d, then: sudo udevadm control --reload",
                 known[i].rule);
        add_problem(found, what, todo);
    }
    return found;
}
