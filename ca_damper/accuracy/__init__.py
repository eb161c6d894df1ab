"""How ``solve_response`` finds an answer: scenes that go on, estimates, and what narrows a bar."""
