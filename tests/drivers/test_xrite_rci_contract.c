/* test_xrite_rci_contract.c - the contract of drivers, held by xrite_rci. */
#include <string.h>

#include "drivers/xrite_rci/xrite_rci.h"
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
    if (strcmp(action, "count shots") == 0) {
        for (size_t i = 0; i < CUES_MAX; i++)
            wire.cue[i].on = 0;
        wire_memory_act(wire.wire, "operator leaves");
        wire_memory_act(wire.wire, "place skin");
    }
    return wire_memory_act(wire.wire, action);
}

static void disconnect(void)
{
    wire_memory_free(wire.wire);
    wire.wire = NULL;
}

/* Its operator follows the display; who calibrates by the driver then puts it on white again. */
static const char *set_up(enum contract_situation situation)
{
    cued_wire_init(&wire, wire_memory_make(&sim_sp62, situation == CONTRACT_TAKES_TIME
                                                          ? "delays=0.6,operator_ms=600"
                                                          : "delays=0,operator_ms=1,samples=3"));
    TEST_ASSERT_NOT_NULL(wire.wire);
    cue(&wire, "RM", CUE_ALWAYS, "place white");
    if (situation == CONTRACT_FALLS_SILENT) /* the rest of the first, and CE before the second */
        cue(&wire, "RM", 2, "fault silence on 6");
    if (situation == CONTRACT_SILENT)
        wire_memory_act(wire.wire, "fault silence from 1");
    return "";
}

static const struct contract_fixture fixtures[] = {
    { .driver = &xrite_rci_driver,
      .set_up = set_up,
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
