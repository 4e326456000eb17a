"""The leaderboard: a place for what will check submissions by re-simulating them; nothing is here yet."""
