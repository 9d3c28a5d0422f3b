"""From measurements to random fields: fits of profiles, parameters from peaks, designs of tests."""
