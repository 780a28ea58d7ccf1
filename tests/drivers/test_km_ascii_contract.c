/* test_km_ascii_contract.c - the contract of drivers, held by km_ascii. */
#include "drivers/km_ascii/km_ascii.h"
#include "tests/drivers/contract.h"
#include "tests/drivers/cue.h"
#include "unity.h"

/* A simulator on a wire in this program. */
static struct cued_wire wire;

static const struct link_source *wire_source(void)
{
    return &wire.source;
}

static bool act(const char *action)
{
    return wire_memory_act(wire.wire, action);
}

static void disconnect(void)
{
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

static void connect(const struct sim_kind *kind, const char *options, const char *zero)
{
    cued_wire_init(&wire, wire_memory_make(kind, options));
    TEST_ASSERT_NOT_NULL(wire.wire);
    /* The operator does as he is told. */
    cue(&wire, zero, CUE_ALWAYS, "place black");
    cue(&wire, "CAL", CUE_ALWAYS, "place white");
    cue(&wire, "MES", CUE_ALWAYS, "place skin");
}

static const char *set_up_cm700d(enum contract_situation situation)
{
    connect(&sim_cm700d, situation == CONTRACT_TAKES_TIME ? "delays=0.4" : "delays=0,samples=3",
            "ZRC");
    if (situation == CONTRACT_FALLS_SILENT)
        cue(&wire, "MES", 2, "fault silence");
    if (situation == CONTRACT_SILENT)
        wire_memory_act(wire.wire, "fault silence from 1");
    return "";
}

/* Its answer to a shot is the spectrum: it may take as long as that. */
static const char *set_up_cm2600d(enum contract_situation situation)
{
    if (situation == CONTRACT_FALLS_SILENT)
        return NULL;
    connect(&sim_cm2600d, situation == CONTRACT_TAKES_TIME ? "delays=0.4" : "delays=0", "UZC");
    if (situation == CONTRACT_SILENT)
        wire_memory_act(wire.wire, "fault silence from 1");
    return "";
}

static const struct contract_fixture fixtures[] = {
    { .driver = &km_ascii_driver,
      .set_up = set_up_cm700d,
      .tear_down = disconnect,
      .wire = wire_source,
      .act = act,
      .deterministic = true },
    { .driver = &km_ascii_driver,
      .set_up = set_up_cm2600d,
      .tear_down = disconnect,
      .wire = wire_source,
      .act = act,
      .deterministic = true },
};

void setUp(void)
{
    contract_set_up();
}

void tearDown(void)
{
    contract_tear_down();
}

int main(void)
{
    return contract_main(fixtures, sizeof fixtures / sizeof *fixtures);
}
